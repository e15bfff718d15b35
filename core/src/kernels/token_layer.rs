//! Layers on the token grid: linear, 3x3 or depthwise convolution.
use super::tokens::{NO_BIAS, SLOPE, TokenParams, for_each_layer_workgroup};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use alloc::vec;

kernel! { pub static TOKEN_LAYER = mte_slam_shaders::kernels::token_layer, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { layers, parameters: w, raw, tokens } = dispatch.views();
    for_each_layer_workgroup(dispatch, &p, layers, |l, group| {
        let (inputs, outputs) = (l.inputs as usize, l.outputs as usize);
        let reach = l.taps as i32 / 2;
        // The shader's invocation is a (token, four outputs); here a token at a time is faster.
        let quads = l.quads();
        let first = group * 64;
        let mut sums = vec![0.0_f32; outputs];
        let mut x = vec![0.0_f32; inputs];
        for token in first.div_ceil(quads)..(first + 64).div_ceil(quads).min(p.tokens()) {
            for (o, s) in sums.iter_mut().enumerate() {
                *s = if l.bias == NO_BIAS { 0.0 } else { w[l.bias as usize + o] };
            }
            let mut tap = 0;
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let from = p.neighbour(token, dx, dy);
                    tap += 1;
                    let Some(from) = from else { continue };
                    if l.from_raw == 1 {
                        let at = (p.raw_at + l.input) as usize + from * p.raw_stride as usize;
                        x.copy_from_slice(&raw[at..at + inputs]);
                    } else {
                        let at = from * p.stride as usize + l.input as usize;
                        for (v, word) in x.iter_mut().zip(&tokens[at..at + inputs]) {
                            *v = load_f32(word);
                        }
                    }
                    if l.depthwise == 1 {
                        let row = &w[l.weights as usize + (tap - 1) * inputs..][..inputs];
                        for ((s, v), w) in sums.iter_mut().zip(&x).zip(row) {
                            *s += v * w;
                        }
                    } else {
                        let at = l.weights as usize + (tap - 1) * inputs * outputs;
                        for (v, row) in x.iter().zip(w[at..].chunks_exact(outputs)) {
                            for (s, w) in sums.iter_mut().zip(row) {
                                *s += v * w;
                            }
                        }
                    }
                }
            }
            let at = token * p.stride as usize + l.output as usize;
            for (o, s) in sums.iter().enumerate() {
                let y = if l.activation == 1 && *s < 0.0 { SLOPE * s } else { *s };
                store_f32(&tokens[at + o], y);
            }
        }
    });
}
