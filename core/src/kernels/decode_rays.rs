//! Decoders and class head on composited features, their losses and gradients.
use super::shared::{
    Ray, class_logit, color_backward, color_hidden, color_output, head_row, semantic_backward,
    semantic_hidden, semantic_output, surface_weights,
};
use super::{CpuDispatch, load_f32, store_f32, store_u32};
use crate::{
    layout::{
        FieldParams, RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_APPEARANCE, STATE_APPEARANCE_GRADIENT,
        STATE_COLOR_DELTA, STATE_COLOR_HIDDEN, STATE_COLOR_HIDDEN_DELTA, STATE_DEPTH,
        STATE_FEATURE, STATE_FEATURE_DELTA, STATE_SEMANTIC, STATE_SEMANTIC_GRADIENT,
        STATE_SEMANTIC_HIDDEN, STATE_SEMANTIC_HIDDEN_DELTA,
    },
};
use core::sync::atomic::AtomicU32;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

kernel! {
    /// Colour, semantic feature and classes of each ray; losses; gradients at the features.
    pub static DECODE_RAYS = "decode_rays" {
        workgroup_size: 64,
        params: FieldParams,
        twin: twin,
        bindings: [
            rays: Read,
            decoders: Read,
            ray_state: ReadWrite,
            ray_out: ReadWrite,
            logits_gradient: ReadWrite,
        ],
    }
}

fn put(state: &[AtomicU32], at: u32, values: &[f32]) {
    for (k, v) in values.iter().enumerate() {
        store_f32(&state[at as usize * 4 + k], *v);
    }
}

fn get<const N: usize>(state: &[AtomicU32], at: u32) -> [f32; N] {
    core::array::from_fn(|k| load_f32(&state[at as usize * 4 + k]))
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let (rays, decoders) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let (ray_state, ray_out, logits) = (dispatch.write(2), dispatch.write(3), dispatch.write(4));
    let surface = surface_weights(decoders);
    let inv_rays = 1.0 / p.rays as f32;
    dispatch.for_each_invocation(|id| {
        if id >= p.rays as usize {
            return;
        }
        let ray = Ray::load(rays, id);
        let state = &ray_state[id * RAY_STATE_FLOATS..(id + 1) * RAY_STATE_FLOATS];
        let [depth, opacity, _, range] = get::<4>(state, STATE_DEPTH);

        let hidden = color_hidden(surface, &get(state, STATE_APPEARANCE));
        let rgb = color_output(surface, &hidden);
        let (mut loss_color, mut dc) = (0.0, [0.0; 4]);
        if !ray.masked() {
            for k in 0..3 {
                let e = rgb[k] - ray.color[k];
                loss_color += e * e / 3.0;
                dc[k] = e * 2.0 / 3.0 * p.weight_color * inv_rays * rgb[k] * (1.0 - rgb[k]);
            }
        }
        let (dh, df) = color_backward(surface, &hidden, &dc);
        put(state, STATE_COLOR_HIDDEN, &hidden);
        put(state, STATE_COLOR_HIDDEN_DELTA, &dh);
        put(state, STATE_COLOR_DELTA, &dc);
        put(state, STATE_APPEARANCE_GRADIENT, &df);

        let (mut loss_depth, mut ddepth, mut depth_error) = (0.0, 0.0, 0.0);
        if ray.depth > 0.0 {
            let e = depth - ray.depth;
            loss_depth = e * e;
            ddepth = 2.0 * e * p.weight_depth * inv_rays;
            depth_error = e.abs();
        }
        put(state, STATE_DEPTH, &[depth, opacity, ddepth, range]);

        let (mut loss_semantic, mut best_class) = (0.0, 255);
        if p.classes > 0 {
            let hidden = semantic_hidden(surface, &get(state, STATE_SEMANTIC));
            let feature = semantic_output(surface, &hidden);
            let logit = |c| class_logit(decoders, &feature, p.classes, c);
            let (mut best, mut sum, mut own) = (-1e30_f32, 0.0_f32, 0.0);
            for c in 0..p.classes {
                let l = logit(c);
                if l > best {
                    sum = sum * (best - l).exp() + 1.0;
                    best = l;
                    best_class = c;
                } else {
                    sum += (l - best).exp();
                }
                if c == ray.label {
                    own = l;
                }
            }
            let mut scale = 0.0;
            if ray.label < p.classes {
                loss_semantic = sum.ln() + best - own;
                scale = p.weight_semantic * inv_rays;
            }
            let mut dfeature = [0.0; 16];
            for c in 0..p.classes {
                let target = if c == ray.label { 1.0 } else { 0.0 };
                let g = scale * ((logit(c) - best).exp() / sum - target);
                store_f32(&logits[id * p.classes as usize + c as usize], g);
                let row = head_row(decoders, c);
                for k in 0..16 {
                    dfeature[k] += g * row[k];
                }
            }
            let (dh, df) = semantic_backward(surface, &hidden, &dfeature);
            put(state, STATE_FEATURE, &feature);
            put(state, STATE_FEATURE_DELTA, &dfeature);
            put(state, STATE_SEMANTIC_HIDDEN, &hidden);
            put(state, STATE_SEMANTIC_HIDDEN_DELTA, &dh);
            put(state, STATE_SEMANTIC_GRADIENT, &df);
        }
        let out = &ray_out[id * RAY_OUT_FLOATS..(id + 1) * RAY_OUT_FLOATS];
        put(out, 0, &[rgb[0], rgb[1], rgb[2], depth, opacity, 0.0, loss_color, loss_depth]);
        store_u32(&out[5], best_class);
        put(out, 2, &[loss_semantic, 0.0, depth_error, 0.0]);
    });
}
