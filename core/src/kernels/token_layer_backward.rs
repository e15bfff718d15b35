//! Gradients at the inputs of a layer on the token grid.
use super::{
    CpuDispatch, load_f32, store_f32,
    tokens::{SLOPE, TokenParams},
};
use alloc::vec;

kernel! {
    /// Adds a layer's contribution to the gradients at its inputs.
    pub static TOKEN_LAYER_BACKWARD = "token_layer_backward" {
        workgroup_size: 64,
        params: TokenParams,
        twin: twin,
        bindings: [parameters: Read, tokens: Read, token_gradient: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let (w, tokens) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let gradient = dispatch.write(2);
    let (inputs, outputs, stride) = (p.inputs as usize, p.outputs as usize, p.stride as usize);
    let reach = p.taps as i32 / 2;
    dispatch.for_each_workgroup(|group| {
        let first = group as usize * 64;
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
                    let at = to * stride + p.output as usize;
                    for (o, d) in delta.iter_mut().enumerate() {
                        let slope =
                            if p.activation == 1 && tokens[at + o] < 0.0 { SLOPE } else { 1.0 };
                        *d = slope * load_f32(&gradient[at + o]);
                    }
                    if p.depthwise == 1 {
                        let row = &w[p.weights as usize + (tap - 1) * inputs..][..inputs];
                        for ((s, d), w) in sums.iter_mut().zip(&delta).zip(row) {
                            *s += d * w;
                        }
                    } else {
                        let at = p.weights as usize + (tap - 1) * inputs * outputs;
                        for (s, row) in sums.iter_mut().zip(w[at..].chunks_exact(outputs)) {
                            *s += delta.iter().zip(row).map(|(d, w)| d * w).sum::<f32>();
                        }
                    }
                }
            }
            let at = token * stride + p.input as usize;
            for (cell, s) in gradient[at..at + inputs].iter().zip(&sums) {
                store_f32(cell, load_f32(cell) + s);
            }
        }
    });
}
