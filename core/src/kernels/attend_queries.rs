//! Gradients of the attention at its queries.
use super::{
    CpuDispatch,
    attend_tokens::{attended, columns, pair_weight},
    load_f32, store_f32,
    tokens::{NO_RESIDUAL, TILE, TokenParams, dot, sixteen},
};

kernel! {
    /// Adds dL/dQ and dL/d(residual); keeps sum of output x gradient for `attend_keys`.
    pub static ATTEND_QUERIES = "attend_queries" {
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
        for token in first..(first + TILE).min(p.tokens()) {
            let row = token * stride;
            let q = columns(tokens, row + query);
            let g = sixteen(gradient, row + p.output as usize);
            let mean = dot(&g, &attended(&p, tokens, token));
            let log_sum = tokens[row + p.statistics as usize];
            let mut dq = [0.0_f32; 16];
            for key in 0..p.keys() {
                let at = p.key_token(key) * stride + query;
                let k = columns(tokens, at + 16);
                let w = pair_weight(q, k, log_sum);
                let ds = 0.25 * w * (dot(&g, columns(tokens, at + 32)) - mean);
                (0..16).for_each(|c| dq[c] += ds * k[c]);
            }
            store_f32(&gradient[row + p.statistics as usize], mean);
            let add = |at: usize, v: f32| {
                store_f32(&gradient[row + at], load_f32(&gradient[row + at]) + v);
            };
            for c in 0..16 {
                add(query + c, dq[c]);
                if p.residual != NO_RESIDUAL {
                    add(p.residual as usize + c, g[c]);
                }
            }
        }
    });
}
