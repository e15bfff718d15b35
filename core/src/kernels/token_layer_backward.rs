//! Gradients at the inputs of layers on the token grid.
use super::tokens::{SLOPE, TokenParams, for_each_layer_workgroup};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use alloc::vec;

kernel! { pub static TOKEN_LAYER_BACKWARD = mte_slam_shaders::kernels::token_layer_backward, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { layers, parameters: w, tokens, token_gradient: gradient } = dispatch.views();
    let stride = p.stride as usize;
    for_each_layer_workgroup(dispatch, &p, layers, |l, group| {
        let (inputs, outputs) = (l.inputs as usize, l.outputs as usize);
        let reach = l.taps as i32 / 2;
        let first = group * 64;
        let mut delta = vec![0.0_f32; outputs];
        let mut sums = vec![0.0_f32; inputs];
        for token in first.div_ceil(inputs)..(first + 64).div_ceil(inputs).min(p.tokens()) {
            sums.fill(0.0);
            let mut tap = 0;
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    tap += 1;
                    // The token whose tap (dx, dy) is this one.
                    let Some(to) = p.neighbour(token, -dx, -dy) else { continue };
                    let at = to * stride + l.output as usize;
                    for (o, d) in delta.iter_mut().enumerate() {
                        let slope =
                            if l.activation == 1 && tokens[at + o] < 0.0 { SLOPE } else { 1.0 };
                        *d = slope * load_f32(&gradient[at + o]);
                    }
                    if l.depthwise == 1 {
                        let row = &w[l.weights as usize + (tap - 1) * inputs..][..inputs];
                        for ((s, d), w) in sums.iter_mut().zip(&delta).zip(row) {
                            *s += d * w;
                        }
                    } else {
                        let at = l.weights as usize + (tap - 1) * inputs * outputs;
                        for (s, row) in sums.iter_mut().zip(w[at..].chunks_exact(outputs)) {
                            *s += delta.iter().zip(row).map(|(d, w)| d * w).sum::<f32>();
                        }
                    }
                }
            }
            let at = token * stride + l.input as usize;
            for (cell, s) in gradient[at..at + inputs].iter().zip(&sums) {
                store_f32(cell, load_f32(cell) + s);
            }
        }
    });
}
