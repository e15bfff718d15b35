//! Anchors settle where the nearest one tells the head's class.
use super::{
    CpuDispatch, load_f32, load_u32,
    shared::{Ray, likeliest_class},
    store_f32, store_u32,
};
use crate::layout::{
    ANCHOR_FLOATS, FEATURE, NO_ANCHOR, RAY_STATE_FLOATS, STATE_ANCHOR, STATE_FEATURE,
};

params! {
    /// Parameters of [`SETTLE_ANCHORS`].
    pub struct SettleAnchorsParams {
        /// Rays of the batch; 0: the anchors stay where they are and take the head's classes.
        rays: u32,
        /// Slots of anchors.
        anchors: u32,
        /// Classes.
        classes: u32,
        /// Share of the way to the weighted mean of what pulls and pushes, 0..1.
        rate: f32,
        /// How sharply rays count that are mistaken, or nearly so.
        slope: f32,
        /// Unused.
        spare0: u32,
        /// Unused.
        spare1: u32,
        /// Unused.
        spare2: u32,
    }
}

kernel! {
    /// A step of generalised learning vector quantisation (Sato and Yamada, 1996) with the head as
    /// the teacher: with d the squared distance of a ray's feature to the nearest anchor of its class
    /// and e to the nearest of another (`match_rivals`), the former comes closer by s e / (d + e), the
    /// latter goes by s d / (d + e), where s is the logistic function of slope (d - e) / (d + e).
    /// After that an anchor's class is the head's.
    pub static SETTLE_ANCHORS = "settle_anchors" {
        workgroup_size: 64,
        params: SettleAnchorsParams,
        twin: twin,
        bindings: [rays: Read, ray_state: Read, decoders: Read, anchors: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: SettleAnchorsParams = dispatch.params();
    let (ray_words, ray_state) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let (decoders, anchors) = (dispatch.read_f32(2), dispatch.write(3));
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
            if Ray::load(ray_words, ray).masked() {
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
