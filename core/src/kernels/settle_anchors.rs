//! Anchors settle where the nearest one gives the head's class.
pub use mte_slam_shaders::kernels::settle_anchors::SettleAnchorsParams;

use super::shared::likeliest_class;
use crate::kernel::{CpuDispatch, load_f32, load_u32, store_f32, store_u32};
use crate::layout::{
    ANCHOR_FLOATS, FEATURE, NO_ANCHOR, RAY_STATE_FLOATS, STATE_ANCHOR, STATE_FEATURE,
};

kernel! { pub static SETTLE_ANCHORS = mte_slam_shaders::kernels::settle_anchors, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: SettleAnchorsParams = dispatch.params();
    let Views { rays: ray_words, ray_state, decoders, anchors } = dispatch.views();
    dispatch.for_each_workgroup(|index| {
        let anchor = &anchors[index as usize * ANCHOR_FLOATS..(index as usize + 1) * ANCHOR_FLOATS];
        if load_u32(&anchor[16]) == 255 {
            return;
        }
        let mut vector: [f32; FEATURE] = core::array::from_fn(|k| load_f32(&anchor[k]));
        let (mut sum, mut total) = ([0.0_f32; FEATURE], 0.0_f32);
        for ray in 0..p.rays as usize {
            let state = &ray_state[ray * RAY_STATE_FLOATS..];
            let at = &state[STATE_ANCHOR as usize * 4..];
            let (own, rival) = (at[0].to_bits(), at[1].to_bits());
            let concerned = own == index || rival == index;
            if !concerned || own == NO_ANCHOR || rival == NO_ANCHOR {
                continue;
            }
            if ray_words[ray].masked() {
                continue;
            }
            let (d, e) = (at[2], at[3]);
            let both = (d + e).max(1e-12);
            // The exponential must not overflow, which shaders need not survive.
            let mistaken = 1.0 / (1.0 + libm::expf((p.slope * (e - d) / both).min(80.0)));
            let weight = mistaken * if own == index { e } else { -d } / both;
            total += weight.abs();
            for (k, s) in sum.iter_mut().enumerate() {
                *s += weight * (state[STATE_FEATURE as usize * 4 + k] - vector[k]);
            }
        }
        if total > 0.0 {
            let step = p.rate / total.max(1e-12);
            for (v, s) in vector.iter_mut().zip(sum) {
                *v += step * s;
            }
        }
        let class = likeliest_class(decoders, &vector, p.classes);
        if p.rays > 0 && class != load_u32(&anchor[16]) {
            return;
        }
        for (v, cell) in vector.iter().zip(anchor) {
            store_f32(cell, *v);
        }
        store_u32(&anchor[16], class);
    });
}
