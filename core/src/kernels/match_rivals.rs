//! The nearest anchors of a ray's class and of another.
use super::{
    CpuDispatch, add_i32,
    shared::{RAY_MASKED, RAY_WORDS},
    store_f32, store_u32,
};
use crate::layout::{
    ANCHOR_FLOATS, FEATURE, NO_ANCHOR, NO_DISTANCE, RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_ANCHOR,
    STATE_FEATURE,
};

params! {
    /// Parameters of [`MATCH_RIVALS`].
    pub struct MatchRivalsParams {
        /// Rays of the batch.
        rays: u32,
        /// Slots of anchors.
        anchors: u32,
        /// Classes.
        classes: u32,
        /// Unused.
        spare0: u32,
    }
}

kernel! {
    /// For every decoded ray the nearest anchors of the class that the head gives it and of any
    /// other: at [`STATE_ANCHOR`] their indices (bits, [`NO_ANCHOR`] without one) and squared
    /// distances. The ray's label becomes the head's class, so that `maintain_anchors` finds
    /// classes of the head that have no anchor, and is counted in `class_support`: for each class of
    /// the head the rays whose labels agree and those whose labels do not.
    pub static MATCH_RIVALS = "match_rivals" {
        workgroup_size: 64,
        params: MatchRivalsParams,
        twin: twin,
        bindings: [
            ray_out: Read,
            anchors: Read,
            rays: ReadWrite,
            ray_state: ReadWrite,
            class_support: ReadWrite,
        ],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: MatchRivalsParams = dispatch.params();
    let (ray_out, anchors) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let (rays, ray_state) = (dispatch.write(2), dispatch.write(3));
    let support = dispatch.write(4);
    dispatch.for_each_invocation(|ray| {
        if ray >= p.rays as usize {
            return;
        }
        let state = &ray_state[ray * RAY_STATE_FLOATS..(ray + 1) * RAY_STATE_FLOATS];
        let feature: [f32; FEATURE] =
            core::array::from_fn(|k| super::load_f32(&state[STATE_FEATURE as usize * 4 + k]));
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
        let was = super::load_u32(label);
        let masked = super::load_u32(&rays[ray * RAY_WORDS + 7]) & RAY_MASKED != 0;
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
