//! Gradient of the geometry decoder.
use super::shared::{geometry_decoder, geometry_deltas};
use super::{CpuDispatch, store_f32};
use crate::layout::{FieldParams, GEOMETRY_FLOATS};

kernel! {
    /// Partial gradients of the geometry decoder, a row of 820 floats a workgroup. Samples come in
    /// tiles of 64; every `decoder_stride`-th tile is used and scaled up.
    pub static GEOMETRY_WEIGHTS = "geometry_weights" {
        workgroup_size: 64,
        params: FieldParams,
        twin: twin,
        bindings: [
            features: Read,
            distance_gradient: Read,
            decoders: Read,
            partials: ReadWrite,
        ],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let (features, gradient, decoders) =
        (dispatch.read_f32(0), dispatch.read_f32(1), dispatch.read_f32(2));
    let partials = dispatch.write(3);
    let count = (p.rays * p.samples) as usize;
    let tiles = count.div_ceil(64);
    let stride = p.decoder_stride.max(1);
    let groups = dispatch.workgroups[0];
    dispatch.for_each_workgroup(|group| {
        let mut row = [0.0_f32; GEOMETRY_FLOATS];
        let first = (group * stride + p.iteration % stride) as usize;
        for tile in (first..tiles).step_by((groups * stride) as usize) {
            for sample in tile * 64..((tile + 1) * 64).min(count) {
                if gradient[sample] == 0.0 {
                    continue;
                }
                let mut f = [0.0; 32];
                f.copy_from_slice(&features[sample * 32..sample * 32 + 32]);
                let s = geometry_decoder(decoders, &f);
                let d = geometry_deltas(decoders, &s, gradient[sample] * stride as f32);
                for k in 0..32 {
                    for j in 0..16 {
                        row[k * 16 + j] += f[k] * d.d1[j];
                    }
                }
                for k in 0..16 {
                    row[512 + k] += d.d1[k];
                    for j in 0..16 {
                        row[528 + k * 16 + j] += s.h1[k] * d.d2[j];
                    }
                    row[784 + k] += d.d2[k];
                    row[800 + k] += s.h2[k] * d.d3;
                }
                row[816] += d.d3;
            }
        }
        let out = &partials[group as usize * GEOMETRY_FLOATS..][..GEOMETRY_FLOATS];
        for (word, v) in out.iter().zip(row) {
            store_f32(word, v);
        }
    });
}
