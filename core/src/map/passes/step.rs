//! Adam's steps of map and poses, with the decoders' gradients that they need.
use crate::{
    call::Call,
    commands::Commands,
    kernels::{
        pose_step::{self, PoseStepParams},
        reduce_partials::{self, ReducePartialsParams},
        weight_gradient::{self, WeightGradientParams},
    },
    layout::{
        FEATURE, GEOMETRY_FLOATS, HEAD_FLOATS, STATE_APPEARANCE, STATE_COLOR_DELTA,
        STATE_COLOR_HIDDEN, STATE_COLOR_HIDDEN_DELTA, STATE_FEATURE, STATE_FEATURE_DELTA,
        STATE_SEMANTIC, STATE_SEMANTIC_HIDDEN, STATE_SEMANTIC_HIDDEN_DELTA,
    },
    map::{
        Batch, Map, ParameterTensor, Rates, Scratch,
        parameters::AdamStep,
        sample_head,
        scratch::{DECODER_CHUNK, GEOMETRY_ROWS},
    },
};
use alloc::vec;
use mte_slam_shaders::decoders::{COLOR, Layer, SEMANTIC};

/// One Adam step of the window's poses from the last backward pass.
pub fn record_pose_step(
    r: &mut Commands,
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
    pose_step::Buffers {
        ray_state: scratch.ray_state,
        ray_out: scratch.ray_out,
        window: scratch.window,
        poses: map.frames.poses,
        pose_state: map.frames.pose_state,
    }
    .record_workgroups(r, &p, [b.frames, 1, 1]);
}

/// Decoder gradients from the last backward pass, then Adam on everything.
pub fn record_step(
    r: &mut Commands,
    map: &mut Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rates: Rates,
) {
    reduce_partials::Buffers {
        partials: scratch.geometry_partials.floats(),
        gradient: map.decoders.gradient.cast(),
    }
    .record(
        r,
        &ReducePartialsParams {
            rows: GEOMETRY_ROWS,
            columns: GEOMETRY_FLOATS as u32,
            row: GEOMETRY_FLOATS as u32,
            offset: 0,
        },
        GEOMETRY_FLOATS,
    );
    record_updates(r, map, scratch, b, rates, true);
}

/// As [`record_step`], of the semantic planes, their decoder and the class head. The
/// batch's weight of colour must be 0.
pub(crate) fn record_semantic_step(
    r: &mut Commands,
    map: &mut Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rates: Rates,
) {
    record_updates(r, map, scratch, b, rates, false);
}

fn record_updates(
    r: &mut Commands,
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
    // Layers with their activations and deltas in a ray's state.
    let mut layers = vec![
        (COLOR[0], STATE_APPEARANCE, STATE_COLOR_HIDDEN_DELTA),
        (COLOR[1], STATE_COLOR_HIDDEN, STATE_COLOR_DELTA),
    ];
    if map.ray_classes() > 0 {
        let head = Layer {
            inputs: FEATURE,
            outputs: map.classes as usize,
            weights: HEAD_FLOATS,
            bias: HEAD_FLOATS + FEATURE * map.classes as usize,
        };
        layers.push((SEMANTIC[0], STATE_SEMANTIC, STATE_SEMANTIC_HIDDEN_DELTA));
        layers.push((SEMANTIC[1], STATE_SEMANTIC_HIDDEN, STATE_FEATURE_DELTA));
        layers.push((head, STATE_FEATURE, 0));
    }
    for (layer, x, d) in layers {
        let head = layer.weights == HEAD_FLOATS;
        let (inputs, outputs) = (layer.inputs as u32, layer.outputs as u32);
        weight_gradient::Buffers {
            ray_state: scratch.ray_state.floats(),
            logits_gradient: scratch.logits_gradient,
            partials: scratch.decoder_partials,
        }
        .record(
            r,
            &WeightGradientParams {
                rays: p.rays,
                inputs,
                outputs,
                chunk: DECODER_CHUNK,
                input_offset: x * 4,
                delta_offset: d * 4,
                from_logits: u32::from(head),
                row,
                weight_offset: (layer.weights - GEOMETRY_FLOATS) as u32,
                bias_offset: (layer.bias - GEOMETRY_FLOATS) as u32,
                input_stride: if head { 1 } else { outputs },
                output_stride: if head { 16 } else { 1 },
            },
            (chunks * (inputs + 1) * outputs.div_ceil(4)) as usize,
        );
    }
    reduce_partials::Buffers {
        partials: scratch.decoder_partials,
        gradient: map.decoders.gradient.cast(),
    }
    .record(
        r,
        &ReducePartialsParams { rows: chunks, columns: row, row, offset: GEOMETRY_FLOATS as u32 },
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
