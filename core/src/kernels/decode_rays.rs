//! Decoders and class head on composited features; the losses of color, classes, feature and
//! compression; their gradients.
use super::shared::{
    FLAG_ANCHORS, Ray, class_logit, color_backward, color_hidden, color_output, head_row,
    likeliest_class, semantic_backward, semantic_hidden, semantic_output, surface_weights,
};
use crate::kernel::{CpuDispatch, load_f32, store_f32, store_u32};
use crate::layout::{
    ANCHOR_FLOATS, FieldParams, NO_ANCHOR, NO_DISTANCE, RAY_OUT_FLOATS, RAY_STATE_FLOATS,
    STATE_ANCHOR, STATE_APPEARANCE, STATE_APPEARANCE_GRADIENT, STATE_COLOR_DELTA,
    STATE_COLOR_HIDDEN, STATE_COLOR_HIDDEN_DELTA, STATE_DEPTH, STATE_FEATURE, STATE_FEATURE_DELTA,
    STATE_SEMANTIC, STATE_SEMANTIC_GRADIENT, STATE_SEMANTIC_HIDDEN, STATE_SEMANTIC_HIDDEN_DELTA,
    TARGET_FLOATS,
};
use core::sync::atomic::AtomicU32;

kernel! { pub static DECODE_RAYS = mte_slam_shaders::kernels::decode_rays, twin }

fn put(state: &[AtomicU32], at: u32, values: &[f32]) {
    for (k, v) in values.iter().enumerate() {
        store_f32(&state[at as usize * 4 + k], *v);
    }
}

fn get<const N: usize>(state: &[AtomicU32], at: u32) -> [f32; N] {
    core::array::from_fn(|k| load_f32(&state[at as usize * 4 + k]))
}

pub(super) struct Match {
    pub(super) index: u32,
    distance: f32,
    /// The nearest anchor of the ray's own class.
    own_index: u32,
    own_distance: f32,
}

/// A feature this much (squared) further from its label's anchor than from the nearest one is
/// taken for mislabelled; below, the label decides what it is pulled to.
const DOUBT: f32 = 4.0;

impl Match {
    /// The anchor that the compression loss pulls to, and the squared distance.
    fn held_by(&self) -> (u32, f32) {
        if self.own_distance < DOUBT * self.distance {
            (self.own_index, self.own_distance)
        } else {
            (self.index, self.distance)
        }
    }
}

/// The nearest anchor of a feature (paper eq. 9), squared distances.
pub(super) fn nearest_anchor(
    p: &FieldParams,
    anchors: &[f32],
    feature: &[f32; 16],
    label: u32,
) -> Match {
    let mut best = Match {
        index: NO_ANCHOR,
        distance: NO_DISTANCE,
        own_index: NO_ANCHOR,
        own_distance: NO_DISTANCE,
    };
    for (j, a) in anchors.chunks_exact(ANCHOR_FLOATS).take(p.anchors as usize).enumerate() {
        let class = a[16].to_bits();
        if class == 255 {
            continue;
        }
        let distance = (0..16).map(|k| (feature[k] - a[k]) * (feature[k] - a[k])).sum::<f32>();
        if distance < best.distance {
            (best.index, best.distance) = (j as u32, distance);
        }
        if class == label && distance < best.own_distance {
            (best.own_index, best.own_distance) = (j as u32, distance);
        }
    }
    best
}

/// The class of an anchor: what the head says of its vector.
pub(super) fn anchor_class(p: &FieldParams, decoders: &[f32], anchors: &[f32], index: u32) -> u32 {
    let at = index as usize * ANCHOR_FLOATS;
    likeliest_class(decoders, &core::array::from_fn(|k| anchors[at + k]), p.classes)
}

/// The fused feature of the token that a ray's pixel lies in, and its weight.
fn fused_target<'a>(p: &FieldParams, targets: &'a [f32], ray: &Ray) -> Option<&'a [f32]> {
    if p.token_columns == 0 || (p.weight_feature == 0.0 && p.doubt_fused == 0.0) {
        return None;
    }
    let pixel = ray.pixel();
    let column = (pixel % p.width / p.token_size).min(p.token_columns - 1);
    let row = (pixel / p.width / p.token_size).min(p.token_rows - 1);
    let token = (ray.slot() * p.token_rows + row) * p.token_columns + column;
    let at = token as usize * TARGET_FLOATS;
    Some(&targets[at..at + TARGET_FLOATS])
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        rays,
        decoders,
        ray_state,
        ray_out,
        logits_gradient: logits,
        anchors,
        targets,
        class_weights,
    } = dispatch.views();
    let surface = surface_weights(decoders);
    let inv_rays = 1.0 / p.rays as f32;
    dispatch.for_each_invocation(|id| {
        if id >= p.rays as usize {
            return;
        }
        let ray = rays[id];
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
            let label = ray.class();
            let hidden = semantic_hidden(surface, &get(state, STATE_SEMANTIC));
            let feature = semantic_output(surface, &hidden);
            let logit = |c| class_logit(decoders, &feature, p.classes, c);
            // The cross-entropy sees logits that favour classes as the weights do, so that the
            // logits themselves, and the classes by them, need not.
            let adjusted = |c: u32, l: f32| l + class_weights[2 * c as usize + 1];
            let (mut best, mut sum, mut own, mut best_logit) = (-1e30_f32, 0.0_f32, 0.0, -1e30_f32);
            for c in 0..p.classes {
                let l = logit(c);
                if l > best_logit {
                    (best_logit, best_class) = (l, c);
                }
                let l = adjusted(c, l);
                if l > best {
                    sum = sum * libm::expf(best - l) + 1.0;
                    best = l;
                } else {
                    sum += libm::expf(l - best);
                }
                if c == label {
                    own = l;
                }
            }
            let matched = nearest_anchor(&p, anchors, &feature, label);
            let target = fused_target(&p, targets, &ray);
            let (mut scale, mut trust) = (0.0, 1.0);
            if label < p.classes {
                // What anchors doubt, the fused feature may vouch for.
                let by_anchors = p.doubt_anchor > 0.0 && matched.own_index != NO_ANCHOR;
                let mut doubt = 0.0;
                if by_anchors {
                    let nearer = matched.distance - matched.own_distance;
                    doubt = 1.0 - libm::expf(p.doubt_anchor * nearer);
                }
                if let Some(t) = target.filter(|_| p.doubt_fused > 0.0) {
                    let aim = core::array::from_fn(|k| t[k]);
                    let gap = (class_logit(decoders, &aim, p.classes, label) - t[17]).min(0.0);
                    let fits = libm::expf(p.doubt_fused * gap);
                    doubt = if by_anchors {
                        doubt * (1.0 - t[16] * fits)
                    } else {
                        t[16] * (1.0 - fits)
                    };
                }
                trust = 1.0 - doubt;
                let weight = class_weights[2 * label as usize] * trust;
                loss_semantic = weight * (libm::logf(sum) + best - own);
                scale = weight * p.weight_semantic * inv_rays;
            }
            let mut dfeature = [0.0; 16];
            for c in 0..p.classes {
                let target = if c == label { 1.0 } else { 0.0 };
                let g = scale * (libm::expf(adjusted(c, logit(c)) - best) / sum - target);
                store_f32(&logits[id * p.classes as usize + c as usize], g);
                let row = head_row(decoders, c);
                for k in 0..16 {
                    dfeature[k] += g * row[k];
                }
            }
            if p.flags & FLAG_ANCHORS != 0 && matched.index != NO_ANCHOR {
                best_class = anchor_class(&p, decoders, anchors, matched.index);
            }
            let mut loss_feature = 0.0;
            if !ray.masked() {
                if p.weight_compression > 0.0 && matched.index != NO_ANCHOR {
                    let (index, distance) = matched.held_by();
                    let anchor = &anchors[index as usize * ANCHOR_FLOATS..];
                    for k in 0..16 {
                        let e = feature[k] - anchor[k];
                        dfeature[k] += 2.0 * p.weight_compression * inv_rays * e;
                    }
                    loss_feature += p.weight_compression * distance;
                }
                if let Some(target) = target {
                    // With doubts, the fused feature teaches what the label is not trusted to.
                    let share = if p.doubt_fused > 0.0 { 1.0 - trust } else { 1.0 };
                    let weight = p.weight_feature * target[16] * share;
                    for k in 0..16 {
                        let e = feature[k] - target[k];
                        dfeature[k] += 2.0 * weight * inv_rays * e;
                        loss_feature += weight * e * e;
                    }
                }
            }
            let index = f32::from_bits(matched.index);
            put(
                state,
                STATE_ANCHOR,
                &[index, matched.distance, matched.own_distance, loss_feature],
            );
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
