//! Gradients of the decoders that run once per ray.
pub use mte_slam_shaders::kernels::weight_gradient::WeightGradientParams;

use crate::kernel::{CpuDispatch, store_f32};
use crate::layout::RAY_STATE_FLOATS;

kernel! { pub static WEIGHT_GRADIENT = mte_slam_shaders::kernels::weight_gradient, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: WeightGradientParams = dispatch.params();
    let Views { ray_state, logits_gradient: logits, partials } = dispatch.views();
    let quads = p.outputs.div_ceil(4);
    let per_chunk = ((p.inputs + 1) * quads) as usize;
    let chunks = p.rays.div_ceil(p.chunk) as usize;
    dispatch.for_each_invocation(|job| {
        if job >= per_chunk * chunks {
            return;
        }
        let (chunk, k) = ((job / per_chunk) as u32, (job % per_chunk) as u32);
        let (i, o) = (k / quads, (k % quads) * 4);
        let width = (p.outputs - o).min(4) as usize;
        let is_bias = i == p.inputs;
        let mut sum = [0.0_f32; 4];
        for ray in chunk * p.chunk..((chunk + 1) * p.chunk).min(p.rays) {
            let state = &ray_state[ray as usize * RAY_STATE_FLOATS..];
            let x = if is_bias { 1.0 } else { state[(p.input_offset + i) as usize] };
            let d = if p.from_logits == 1 {
                &logits[(ray * p.outputs + o) as usize..][..width]
            } else {
                &state[(p.delta_offset + o) as usize..][..width]
            };
            for c in 0..width {
                sum[c] += x * d[c];
            }
        }
        for c in 0..width {
            let o = o + c as u32;
            let target = if is_bias {
                p.bias_offset + o
            } else {
                p.weight_offset + i * p.input_stride + o * p.output_stride
            };
            store_f32(&partials[(chunk * p.row + target) as usize], sum[c]);
        }
    });
}
