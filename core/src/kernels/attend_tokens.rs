//! Cross-attention over the tokens of an image, streamed over tiles (paper eqs. 1-4).
use super::tokens::{NO_RESIDUAL, TILE, TokenParams, exp_negative, sixteen};
use crate::kernel::{CpuDispatch, load_f32, store_f32};

kernel! { pub static ATTEND_TOKENS = mte_slam_shaders::kernels::attend_tokens, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { tokens } = dispatch.views();
    let (stride, query) = (p.stride as usize, p.query as usize);
    dispatch.for_each_workgroup(|group| {
        let first = group as usize * TILE;
        let count = p.tokens().saturating_sub(first).min(TILE);
        let mut q = [[0.0_f32; 16]; TILE];
        for (i, q) in q.iter_mut().take(count).enumerate() {
            *q = sixteen(tokens, (first + i) * stride + query).map(|x| x * 0.25);
        }
        let (mut largest, mut sum) = ([-1e30_f32; TILE], [0.0_f32; TILE]);
        let mut out = [[0.0_f32; 16]; TILE];
        for tile in (0..p.keys()).step_by(TILE) {
            let n = (p.keys() - tile).min(TILE);
            // Keys transposed: scores of a query are then sums of vectors.
            let (mut k, mut v) = ([[0.0_f32; TILE]; 16], [[0.0_f32; 16]; TILE]);
            for j in 0..n {
                let at = p.key_token(tile + j) * stride + query;
                let key = sixteen(tokens, at + 16);
                (0..16).for_each(|c| k[c][j] = key[c]);
                v[j] = sixteen(tokens, at + 32);
            }
            for i in 0..count {
                let mut s = [0.0_f32; TILE];
                for c in 0..16 {
                    for j in 0..TILE {
                        s[j] += q[i][c] * k[c][j];
                    }
                }
                s[n..].fill(-1e30);
                let top = s.iter().fold(largest[i], |a, b| a.max(*b));
                let keep = exp_negative(largest[i] - top);
                largest[i] = top;
                for x in &mut s {
                    *x = exp_negative(*x - top);
                }
                s[n..].fill(0.0);
                sum[i] = sum[i] * keep + s.iter().sum::<f32>();
                out[i].iter_mut().for_each(|x| *x *= keep);
                for j in 0..n {
                    for c in 0..16 {
                        out[i][c] += s[j] * v[j][c];
                    }
                }
            }
        }
        for i in 0..count {
            let row = (first + i) * stride;
            for c in 0..16 {
                let mut x = out[i][c] / sum[i];
                if p.residual != NO_RESIDUAL {
                    x += load_f32(&tokens[row + p.residual as usize + c]);
                }
                store_f32(&tokens[row + p.output as usize + c], x);
            }
            store_f32(&tokens[row + p.statistics as usize], largest[i] + libm::logf(sum[i]));
        }
    });
}

/// Attention's own output of a token: what was stored without the residual.
pub(super) fn attended(p: &TokenParams, tokens: &[f32], token: usize) -> [f32; 16] {
    let row = token * p.stride as usize;
    core::array::from_fn(|c| {
        let x = tokens[row + p.output as usize + c];
        if p.residual == NO_RESIDUAL { x } else { x - tokens[row + p.residual as usize + c] }
    })
}

/// 16 floats of a token.
pub(super) fn columns(tokens: &[f32], at: usize) -> &[f32; 16] {
    tokens[at..].first_chunk().unwrap_or(&[0.0; 16])
}

/// A tile of keys and values, transposed: scores of a query are then sums of vectors.
pub(super) struct Pairs {
    keys: [[f32; TILE]; 16],
    values: [[f32; TILE]; 16],
}

impl Pairs {
    /// Keys `first` to `first + n`; zeros behind them.
    pub(super) fn load(p: &TokenParams, tokens: &[f32], first: usize, n: usize) -> Pairs {
        let mut pairs = Pairs { keys: [[0.0; TILE]; 16], values: [[0.0; TILE]; 16] };
        for j in 0..n {
            let at = p.key_token(first + j) * p.stride as usize + p.query as usize;
            let (k, v) = (columns(tokens, at + 16), columns(tokens, at + 32));
            for c in 0..16 {
                pairs.keys[c][j] = k[c];
                pairs.values[c][j] = v[c];
            }
        }
        pairs
    }

    /// For a query (scaled), the gradient at its output, its log-sum-exp and its mean gradient: the
    /// pairs' weights, and the gradients at their scores.
    pub(super) fn weigh(
        &self,
        q: &[f32; 16],
        g: &[f32; 16],
        log_sum: f32,
        mean: f32,
    ) -> ([f32; TILE], [f32; TILE]) {
        let (mut w, mut ds) = ([0.0_f32; TILE], [0.0_f32; TILE]);
        for c in 0..16 {
            for j in 0..TILE {
                w[j] += q[c] * self.keys[c][j];
                ds[j] += g[c] * self.values[c][j];
            }
        }
        for j in 0..TILE {
            w[j] = exp_negative((w[j] - log_sum).min(0.0));
            ds[j] = 0.25 * w[j] * (ds[j] - mean);
        }
        (w, ds)
    }
}
