//! Layers on the token grid: linear, 3x3 or depthwise convolution.
use super::{
    CpuDispatch, load_f32, store_f32,
    tokens::{NO_BIAS, SLOPE, TokenParams, for_each_layer_workgroup},
};
use alloc::vec;

kernel! {
    /// Layers whose inputs and outputs lie side by side in a token's row; none reads what another
    /// one of the dispatch writes.
    pub static TOKEN_LAYER = "token_layer" {
        workgroup_size: 64,
        params: TokenParams,
        twin: twin,
        bindings: [layers: Read, parameters: Read, raw: Read, tokens: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let (w, raw) = (dispatch.read_f32(1), dispatch.read_f32(2));
    let tokens = dispatch.write(3);
    for_each_layer_workgroup(dispatch, &p, |l, group| {
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
