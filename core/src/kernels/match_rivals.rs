//! The nearest anchors of a ray's class and of another.
pub use mte_slam_shaders::kernels::match_rivals::MatchRivalsParams;

use super::shared::{RAY_MASKED, RAY_WORDS};
use crate::kernel::{CpuDispatch, add_i32, load_f32, load_u32, store_f32, store_u32};
use crate::layout::{
    ANCHOR_FLOATS, FEATURE, NO_ANCHOR, NO_DISTANCE, RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_ANCHOR,
    STATE_FEATURE,
};

kernel! { pub static MATCH_RIVALS = mte_slam_shaders::kernels::match_rivals, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: MatchRivalsParams = dispatch.params();
    let Views { ray_out, anchors, rays, ray_state, class_support: support } = dispatch.views();
    dispatch.for_each_invocation(|ray| {
        if ray >= p.rays as usize {
            return;
        }
        let state = &ray_state[ray * RAY_STATE_FLOATS..(ray + 1) * RAY_STATE_FLOATS];
        let feature: [f32; FEATURE] =
            core::array::from_fn(|k| load_f32(&state[STATE_FEATURE as usize * 4 + k]));
        let class = ray_out[ray * RAY_OUT_FLOATS + 5].to_bits();
        let (mut own, mut rival) = ((NO_ANCHOR, NO_DISTANCE), (NO_ANCHOR, NO_DISTANCE));
        for (i, a) in anchors.chunks_exact(ANCHOR_FLOATS).take(p.anchors as usize).enumerate() {
            let of_anchor = a[16].to_bits();
            if of_anchor == 255 {
                continue;
            }
            let distance: f32 = feature.iter().zip(a).map(|(f, a)| (f - a) * (f - a)).sum();
            let nearest = if of_anchor == class { &mut own } else { &mut rival };
            if distance < nearest.1 {
                *nearest = (i as u32, distance);
            }
        }
        let label = &rays[ray * RAY_WORDS + 11];
        let was = load_u32(label);
        let masked = load_u32(&rays[ray * RAY_WORDS + 7]) & RAY_MASKED != 0;
        if !masked && class < p.classes && was & 255 < p.classes {
            let disagree = usize::from(was & 255 != class);
            add_i32(&support[2 * class as usize + disagree], 1);
        }
        store_u32(label, (was & !255) | (class & 255));
        let at = &state[STATE_ANCHOR as usize * 4..];
        store_u32(&at[0], own.0);
        store_u32(&at[1], rival.0);
        store_f32(&at[2], own.1);
        store_f32(&at[3], rival.1);
    });
}
