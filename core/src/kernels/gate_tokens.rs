//! Normalised gating and fusion of the three modalities (paper eqs. 7, 8).
use super::tokens::{FUSED_AT, GATE_AT, GEOMETRY_AT, TokenParams, sixteen};
use crate::kernel::{CpuDispatch, load_f32, store_f32};

kernel! { pub static GATE_TOKENS = mte_slam_shaders::kernels::gate_tokens, twin }

pub(super) fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-x))
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { tokens } = dispatch.views();
    dispatch.for_each_invocation(|token| {
        if token >= p.tokens() {
            return;
        }
        let row = token * p.stride as usize;
        let at = row + GATE_AT as usize;
        let gate: [f32; 3] = core::array::from_fn(|m| sigmoid(load_f32(&tokens[at + m])));
        let inv = 1.0 / (gate[0] + gate[1] + gate[2]);
        let mut fused = [0.0; 16];
        for m in 0..3 {
            let weight = gate[m] * inv;
            store_f32(&tokens[at + 4 + m], weight);
            let part = sixteen(tokens, row + GEOMETRY_AT as usize + m * 16);
            (0..16).for_each(|c| fused[c] += weight * part[c]);
        }
        for (c, f) in fused.iter().enumerate() {
            store_f32(&tokens[row + FUSED_AT as usize + c], *f);
        }
    });
}
