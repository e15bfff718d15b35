//! Adam's steps of map and poses, with the decoders' gradients that they need.
use crate::{
    kernels::{
        pose_step::{POSE_STEP, PoseStepParams},
        reduce_partials::{REDUCE_PARTIALS, ReducePartialsParams},
        weight_gradient::{WEIGHT_GRADIENT, WeightGradientParams},
    },
    layout::{
        GEOMETRY_FLOATS, STATE_APPEARANCE, STATE_COLOR_DELTA, STATE_COLOR_HIDDEN,
        STATE_COLOR_HIDDEN_DELTA, STATE_FEATURE, STATE_FEATURE_DELTA, STATE_SEMANTIC,
        STATE_SEMANTIC_HIDDEN, STATE_SEMANTIC_HIDDEN_DELTA,
    },
    map::{
        Batch, Map, ParameterTensor, Rates, Scratch,
        parameters::AdamStep,
        sample_head,
        scratch::{DECODER_CHUNK, GEOMETRY_ROWS},
    },
    recording::Recording,
};
use alloc::vec;

/// One Adam step of the window's poses from the last backward pass.
pub fn record_pose_step(
    r: &mut Recording,
    map: &Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rate_translation_m: f64,
    rate_rotation_rad: f64,
    restart: bool,
) {
    let p = PoseStepParams {
        rays_per_frame: b.rays_per_frame,
        restart: u32::from(restart),
        learning_rate_translation: rate_translation_m as f32,
        learning_rate_rotation: rate_rotation_rad as f32,
        weight_color: b.loss.color as f32,
        weight_depth: b.loss.depth as f32,
    };
    r.dispatch(
        &POSE_STEP,
        &p,
        &[
            scratch.ray_state,
            scratch.ray_out,
            scratch.window,
            map.frames.poses,
            map.frames.pose_state,
        ],
        [b.frames, 1, 1],
    );
}

/// Decoder gradients from the last backward pass, then Adam on everything.
pub fn record_step(
    r: &mut Recording,
    map: &mut Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rates: Rates,
) {
    r.dispatch_1d(
        &REDUCE_PARTIALS,
        &ReducePartialsParams {
            rows: GEOMETRY_ROWS,
            columns: GEOMETRY_FLOATS as u32,
            row: GEOMETRY_FLOATS as u32,
            offset: 0,
        },
        &[scratch.geometry_partials, map.decoders.gradient],
        GEOMETRY_FLOATS,
    );
    record_updates(r, map, scratch, b, rates, true);
}

/// As [`record_step`], of the semantic planes, their decoder and the class head. The
/// batch's weight of colour must be 0.
pub fn record_semantic_step(
    r: &mut Recording,
    map: &mut Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rates: Rates,
) {
    record_updates(r, map, scratch, b, rates, false);
}

fn record_updates(
    r: &mut Recording,
    map: &mut Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rates: Rates,
    all: bool,
) {
    let p = map.params(b);
    let floats = map.decoders.floats;
    let row = (floats - GEOMETRY_FLOATS) as u32;
    let chunks = p.rays.div_ceil(DECODER_CHUNK);
    // (inputs, outputs, activations, deltas, weights, bias)
    let mut layers = vec![
        (32, 32, STATE_APPEARANCE, STATE_COLOR_HIDDEN_DELTA, 0, 1024),
        (32, 4, STATE_COLOR_HIDDEN, STATE_COLOR_DELTA, 1056, 1184),
    ];
    if map.ray_classes() > 0 {
        layers.push((32, 32, STATE_SEMANTIC, STATE_SEMANTIC_HIDDEN_DELTA, 1188, 2212));
        layers.push((32, 16, STATE_SEMANTIC_HIDDEN, STATE_FEATURE_DELTA, 2244, 2756));
        layers.push((16, map.classes, STATE_FEATURE, 0, 2772, 2772 + map.classes * 16));
    }
    for (i, (inputs, outputs, x, d, weight_offset, bias_offset)) in layers.into_iter().enumerate() {
        let head = i == 4;
        r.dispatch_1d(
            &WEIGHT_GRADIENT,
            &WeightGradientParams {
                rays: p.rays,
                inputs,
                outputs,
                chunk: DECODER_CHUNK,
                input_offset: x * 4,
                delta_offset: d * 4,
                from_logits: u32::from(head),
                row,
                weight_offset,
                bias_offset,
                input_stride: if head { 1 } else { outputs },
                output_stride: if head { 16 } else { 1 },
            },
            &[scratch.ray_state, scratch.logits_gradient, scratch.decoder_partials],
            (chunks * (inputs + 1) * outputs.div_ceil(4)) as usize,
        );
    }
    r.dispatch_1d(
        &REDUCE_PARTIALS,
        &ReducePartialsParams { rows: chunks, columns: row, row, offset: GEOMETRY_FLOATS as u32 },
        &[scratch.decoder_partials, map.decoders.gradient],
        row as usize,
    );
    map.step += 1;
    let (status, number) = (map.status, map.step);
    let mut update = |t: &ParameterTensor, quanta: Option<f32>, rate: f64| {
        t.record_adam(r, status, AdamStep { floats: 0..t.floats, quanta, rate, number });
    };
    if all {
        update(&map.geometry, Some(p.scale_geometry), rates.planes);
        update(&map.appearance, Some(p.scale_appearance), rates.planes);
    }
    if map.classes > 0 {
        update(&map.semantic, Some(p.scale_semantic), rates.planes);
    }
    update(&map.decoders, None, rates.decoders);
    sample_head::record_step(r, map, rates, number);
}
