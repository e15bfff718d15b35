//! Gradients of the weights of layers on the token grid.
use super::tokens::{NO_BIAS, SLOPE, TokenParams, for_each_layer_workgroup};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use alloc::vec;

kernel! { pub static TOKEN_WEIGHTS = mte_slam_shaders::kernels::token_weights, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { layers, raw, tokens, token_gradient: gradient, partials } = dispatch.views();
    let stride = p.stride as usize;
    let chunks = p.tokens().div_ceil(p.chunk as usize);
    for_each_layer_workgroup(dispatch, &p, layers, |l, group| {
        let (inputs, outputs) = (l.inputs as usize, l.outputs as usize);
        let taps = (l.taps * l.taps) as usize;
        let depthwise = l.depthwise == 1;
        let per_chunk = l.weight_jobs();
        let reach = l.taps as i32 / 2;
        // The shader's invocation is a few weights of a chunk; here the workgroup of a chunk's
        // first invocation does the chunk, a token at a time.
        let first = group * 64;
        for chunk in first.div_ceil(per_chunk)..(first + 64).div_ceil(per_chunk).min(chunks) {
            let width = if depthwise { 1 } else { outputs };
            let mut sums = vec![0.0_f32; taps * inputs * width];
            let mut biases = vec![0.0_f32; outputs];
            let mut delta = vec![0.0_f32; outputs];
            let mut x = vec![0.0_f32; inputs];
            let end = ((chunk + 1) * p.chunk as usize).min(p.tokens());
            for token in chunk * p.chunk as usize..end {
                let at = token * stride + l.output as usize;
                for (o, d) in delta.iter_mut().enumerate() {
                    let slope = if l.activation == 1 && tokens[at + o] < 0.0 { SLOPE } else { 1.0 };
                    *d = slope * load_f32(&gradient[at + o]);
                }
                biases.iter_mut().zip(&delta).for_each(|(b, d)| *b += d);
                for tap in 0..taps {
                    let dx = tap as i32 % l.taps as i32 - reach;
                    let dy = tap as i32 / l.taps as i32 - reach;
                    let Some(from) = p.neighbour(token, dx, dy) else { continue };
                    let (values, start, row) = if l.from_raw == 1 {
                        (raw, p.raw_at, p.raw_stride as usize)
                    } else {
                        (tokens, 0, stride)
                    };
                    let at = (start + l.input) as usize + from * row;
                    x.copy_from_slice(&values[at..at + inputs]);
                    let sums = &mut sums[tap * inputs * width..(tap + 1) * inputs * width];
                    if depthwise {
                        let both = x.iter().zip(&delta);
                        sums.iter_mut().zip(both).for_each(|(s, (x, d))| *s += x * d);
                    } else {
                        for (x, sums) in x.iter().zip(sums.chunks_exact_mut(outputs)) {
                            sums.iter_mut().zip(&delta).for_each(|(s, d)| *s += x * d);
                        }
                    }
                }
            }
            let row = &partials[chunk * p.row as usize..];
            for (k, s) in sums.iter().enumerate() {
                let (tap, i, o) = (k / width / inputs, k / width % inputs, k % width);
                let to = if depthwise {
                    tap * inputs + i
                } else {
                    tap * inputs * outputs
                        + i * l.input_stride as usize
                        + o * l.output_stride as usize
                };
                store_f32(&row[l.weights as usize + to], *s);
            }
            if l.bias != NO_BIAS {
                for (o, s) in biases.iter().enumerate() {
                    store_f32(&row[l.bias as usize + o], *s);
                }
            }
        }
    });
}
