//! Gradients through the gating.
use super::{
    attend_tokens::columns,
    gate_tokens::sigmoid,
    tokens::{FUSED_AT, GATE_AT, GEOMETRY_AT, TokenParams, dot, sixteen},
};
use crate::kernel::{CpuDispatch, load_f32, store_f32};

kernel! { pub static GATE_BACKWARD = mte_slam_shaders::kernels::gate_backward, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { tokens, token_gradient: gradient } = dispatch.views();
    dispatch.for_each_invocation(|token| {
        if token >= p.tokens() {
            return;
        }
        let row = token * p.stride as usize;
        let at = row + GATE_AT as usize;
        let g = sixteen(gradient, row + FUSED_AT as usize);
        let part = |m: usize| row + GEOMETRY_AT as usize + m * 16;
        let weight: [f32; 3] = core::array::from_fn(|m| tokens[at + 4 + m]);
        let s: [f32; 3] = core::array::from_fn(|m| sigmoid(tokens[at + m]));
        let inv = 1.0 / (s[0] + s[1] + s[2]);
        let d: [f32; 3] = core::array::from_fn(|m| dot(&g, columns(tokens, part(m))));
        let mean = weight[0] * d[0] + weight[1] * d[1] + weight[2] * d[2];
        let add = |at: usize, v: f32| store_f32(&gradient[at], load_f32(&gradient[at]) + v);
        for m in 0..3 {
            add(at + m, (d[m] - mean) * inv * s[m] * (1.0 - s[m]));
            (0..16).for_each(|c| add(part(m) + c, weight[m] * g[c]));
        }
    });
}
