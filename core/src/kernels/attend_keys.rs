//! Gradients of the attention at its keys and values.
use super::{
    attend_tokens::{Pairs, columns},
    tokens::{TILE, TokenParams, sixteen},
};
use crate::kernel::{CpuDispatch, load_f32, store_f32};

kernel! { pub static ATTEND_KEYS = mte_slam_shaders::kernels::attend_keys, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { tokens, token_gradient: gradient } = dispatch.views();
    let (stride, query) = (p.stride as usize, p.query as usize);
    dispatch.for_each_workgroup(|group| {
        let first = group as usize * TILE;
        let n = p.keys().saturating_sub(first).min(TILE);
        let pairs = Pairs::load(&p, tokens, first, n);
        let (mut dk, mut dv) = ([[0.0_f32; TILE]; 16], [[0.0_f32; TILE]; 16]);
        for token in 0..p.tokens() {
            let row = token * stride;
            let q = columns(tokens, row + query);
            let g = sixteen(gradient, row + p.output as usize);
            let log_sum = tokens[row + p.statistics as usize];
            let mean = load_f32(&gradient[row + p.statistics as usize]);
            let (w, ds) = pairs.weigh(&q.map(|x| x * 0.25), &g, log_sum, mean);
            for c in 0..16 {
                for j in 0..TILE {
                    dk[c][j] += ds[j] * q[c];
                    dv[c][j] += w[j] * g[c];
                }
            }
        }
        for j in 0..n {
            let at = p.key_token(first + j) * stride + query;
            for c in 0..16 {
                for (to, v) in [(at + 16 + c, dk[c][j]), (at + 32 + c, dv[c][j])] {
                    store_f32(&gradient[to], load_f32(&gradient[to]) + v);
                }
            }
        }
    });
}
