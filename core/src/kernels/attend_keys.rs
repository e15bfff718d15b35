//! Gradients of the attention at its keys and values.
use super::{
    CpuDispatch,
    attend_tokens::{columns, pair_weight},
    load_f32, store_f32,
    tokens::{TILE, TokenParams, dot, sixteen},
};
use alloc::vec::Vec;

kernel! {
    /// Adds dL/dK and dL/dV. After `attend_queries`.
    pub static ATTEND_KEYS = "attend_keys" {
        workgroup_size: 64,
        params: TokenParams,
        twin: twin,
        bindings: [tokens: Read, token_gradient: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let tokens = dispatch.read_f32(0);
    let gradient = dispatch.write(1);
    let (stride, query) = (p.stride as usize, p.query as usize);
    dispatch.for_each_workgroup(|group| {
        let first = group as usize * TILE;
        let keys = first..(first + TILE).min(p.keys());
        let mut sums: Vec<[[f32; 16]; 2]> = keys.clone().map(|_| [[0.0; 16]; 2]).collect();
        for token in 0..p.tokens() {
            let row = token * stride;
            let q = columns(tokens, row + query);
            let g = sixteen(gradient, row + p.output as usize);
            let log_sum = tokens[row + p.statistics as usize];
            let mean = load_f32(&gradient[row + p.statistics as usize]);
            for (key, [dk, dv]) in keys.clone().zip(&mut sums) {
                let at = p.key_token(key) * stride + query;
                let w = pair_weight(q, columns(tokens, at + 16), log_sum);
                let ds = 0.25 * w * (dot(&g, columns(tokens, at + 32)) - mean);
                for c in 0..16 {
                    dk[c] += ds * q[c];
                    dv[c] += w * g[c];
                }
            }
        }
        for (key, [dk, dv]) in keys.zip(&sums) {
            let at = p.key_token(key) * stride + query;
            for c in 0..16 {
                for (to, v) in [(at + 16 + c, dk[c]), (at + 32 + c, dv[c])] {
                    store_f32(&gradient[to], load_f32(&gradient[to]) + v);
                }
            }
        }
    });
}
