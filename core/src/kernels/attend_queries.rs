//! Gradients of the attention at its queries.
use super::{
    attend_tokens::{Pairs, attended, columns},
    tokens::{NO_RESIDUAL, TILE, TokenParams, dot, sixteen},
};
use crate::kernel::{CpuDispatch, load_f32, store_f32};

kernel! { pub static ATTEND_QUERIES = mte_slam_shaders::kernels::attend_queries, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { tokens, token_gradient: gradient } = dispatch.views();
    let (stride, query) = (p.stride as usize, p.query as usize);
    dispatch.for_each_workgroup(|group| {
        let first = group as usize * TILE;
        let count = p.tokens().saturating_sub(first).min(TILE);
        let (mut q, mut g) = ([[0.0_f32; 16]; TILE], [[0.0_f32; 16]; TILE]);
        let (mut mean, mut log_sum) = ([0.0_f32; TILE], [0.0_f32; TILE]);
        for i in 0..count {
            let row = (first + i) * stride;
            q[i] = columns(tokens, row + query).map(|x| x * 0.25);
            g[i] = sixteen(gradient, row + p.output as usize);
            mean[i] = dot(&g[i], &attended(&p, tokens, first + i));
            log_sum[i] = tokens[row + p.statistics as usize];
        }
        let mut dq = [[0.0_f32; 16]; TILE];
        for tile in (0..p.keys()).step_by(TILE) {
            let n = (p.keys() - tile).min(TILE);
            let pairs = Pairs::load(&p, tokens, tile, n);
            for i in 0..count {
                let (_, ds) = pairs.weigh(&q[i], &g[i], log_sum[i], mean[i]);
                for j in 0..n {
                    let k = columns(tokens, p.key_token(tile + j) * stride + query + 16);
                    (0..16).for_each(|c| dq[i][c] += ds[j] * k[c]);
                }
            }
        }
        for i in 0..count {
            let row = (first + i) * stride;
            store_f32(&gradient[row + p.statistics as usize], mean[i]);
            let add = |at: usize, v: f32| {
                store_f32(&gradient[row + at], load_f32(&gradient[row + at]) + v);
            };
            for c in 0..16 {
                add(query + c, dq[i][c]);
                if p.residual != NO_RESIDUAL {
                    add(p.residual as usize + c, g[i][c]);
                }
            }
        }
    });
}
