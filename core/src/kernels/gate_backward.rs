//! Gradients through the gating.
use super::{
    CpuDispatch,
    attend_tokens::columns,
    gate_tokens::sigmoid,
    load_f32, store_f32,
    tokens::{FUSED_AT, GATE_AT, GEOMETRY_AT, TokenParams, dot, sixteen},
};

kernel! {
    /// From dL/dF to the gate's convolution and the three modalities.
    pub static GATE_BACKWARD = "gate_backward" {
        workgroup_size: 64,
        params: TokenParams,
        twin: twin,
        bindings: [tokens: Read, token_gradient: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let tokens = dispatch.read_f32(0);
    let gradient = dispatch.write(1);
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
