//! Gradient of the geometry decoder.
use super::shared::{geometry_decoder, geometry_deltas};
use crate::kernel::{CpuDispatch, store_f32};
use crate::layout::{FieldParams, GEOMETRY_FLOATS};
use mte_slam_shaders::decoders::GEOMETRY;

kernel! { pub static GEOMETRY_WEIGHTS = mte_slam_shaders::kernels::geometry_weights, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { features, distance_gradient: gradient, decoders, partials } = dispatch.views();
    let count = (p.rays * p.samples) as usize;
    let tiles = count.div_ceil(64);
    let stride = p.decoder_stride.max(1);
    let groups = dispatch.workgroups[0];
    let [first, second, last] = GEOMETRY;
    dispatch.for_each_workgroup(|group| {
        let mut row = [0.0_f32; GEOMETRY_FLOATS];
        let first_tile = (group * stride + p.iteration % stride) as usize;
        for tile in (first_tile..tiles).step_by((groups * stride) as usize) {
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
                    row[first.bias + k] += d.d1[k];
                    for j in 0..16 {
                        row[second.weights + k * 16 + j] += s.h1[k] * d.d2[j];
                    }
                    row[second.bias + k] += d.d2[k];
                    row[last.weights + k] += s.h2[k] * d.d3;
                }
                row[last.bias] += d.d3;
            }
        }
        let out = &partials[group as usize * GEOMETRY_FLOATS..][..GEOMETRY_FLOATS];
        for (word, v) in out.iter().zip(row) {
            store_f32(word, v);
        }
    });
}
