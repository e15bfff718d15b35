//! Gradients of the decoders that run once a ray.
use super::{CpuDispatch, store_f32};
use crate::layout::RAY_STATE_FLOATS;

params! {
    /// Parameters of [`WEIGHT_GRADIENT`].
    pub struct WeightGradientParams {
        /// Rays.
        rays: u32,
        /// Inputs of the layer.
        inputs: u32,
        /// Outputs of the layer.
        outputs: u32,
        /// Rays a chunk; a chunk is a row of partials.
        chunk: u32,
        /// Offset of the inputs in a ray's state \[floats\].
        input_offset: u32,
        /// Offset of the deltas in a ray's state \[floats\].
        delta_offset: u32,
        /// 1: the deltas are the logits' gradients.
        from_logits: u32,
        /// Floats a row of partials.
        row: u32,
        /// Where the weights start in a row.
        weight_offset: u32,
        /// Where the bias starts in a row.
        bias_offset: u32,
        /// Floats from one input's weights to the next one's.
        input_stride: u32,
        /// Floats from one output's weights to the next one's.
        output_stride: u32,
    }
}

kernel! {
    /// dW = sum over rays of input x delta, in chunks of rays.
    pub static WEIGHT_GRADIENT = "weight_gradient" {
        workgroup_size: 64,
        params: WeightGradientParams,
        twin: twin,
        bindings: [ray_state: Read, logits_gradient: Read, partials: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: WeightGradientParams = dispatch.params();
    let (ray_state, logits) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let partials = dispatch.write(2);
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
