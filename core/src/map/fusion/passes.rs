//! The passes of the fusion over a stored frame's tokens.
use super::{
    CHUNKS, Fusion, FusionScratch,
    layers::{Group, Step},
};
use crate::{
    kernels::{
        attend_keys::ATTEND_KEYS,
        attend_queries::ATTEND_QUERIES,
        attend_tokens::ATTEND_TOKENS,
        extract_tokens::EXTRACT_TOKENS,
        gate_backward::GATE_BACKWARD,
        gate_tokens::GATE_TOKENS,
        recall_tokens::RECALL_TOKENS,
        reduce_partials::{REDUCE_PARTIALS, ReducePartialsParams},
        token_layer::TOKEN_LAYER,
        token_layer_backward::TOKEN_LAYER_BACKWARD,
        token_loss::TOKEN_LOSS,
        token_weights::TOKEN_WEIGHTS,
        tokens::{
            APPEARANCE_AT, FIRST_AT, GUIDED_AT, NO_RESIDUAL, REFINED_AT, SECOND_AT, STATISTICS_AT,
            TILE, TokenParams,
        },
    },
    layout::{FieldParams, HEAD_FLOATS},
    map::{Map, Scratch, parameters::AdamStep},
    recording::{BufferId, Recording},
};

/// Fused features of a stored frame; they become the targets of its rays. Records nothing without a
/// fusion, as all passes here.
pub fn record_forward(r: &mut Recording, map: &Map, scratch: &Scratch, slot: u32) {
    record_tokens(r, map, scratch, slot, false);
}

/// Forward pass, losses and gradients of the fusion on a stored frame; nothing moves yet.
pub fn record_backward(r: &mut Recording, map: &Map, scratch: &Scratch, slot: u32) {
    let (Some(f), Some(s)) = (&map.fusion, &scratch.fusion) else { return };
    let p = token_params(map, f, slot);
    let n = f.count();
    r.clear(s.token_gradient, 0, n * f.stride as usize);
    record_tokens(r, map, scratch, slot, true);
    r.dispatch_1d(&GATE_BACKWARD, &p, &[s.tokens, s.token_gradient], n);
    for step in &f.schedule.backward {
        match step {
            Step::Layers(group) => r.dispatch(
                &TOKEN_LAYER_BACKWARD,
                &TokenParams { layer: group.first, ..p },
                &[f.schedule.table, f.parameters.values, s.tokens, s.token_gradient],
                group.workgroups(|l| n * l.inputs as usize),
            ),
            Step::FirstAttention => record_attention_backward(r, f, s, &first(p)),
            Step::SecondAttention => record_attention_backward(r, f, s, &second(f, p)),
        }
    }
    record_weights(r, f, s, &f.schedule.weights, [s.raw, s.partials], p);
    if let Some(group) = &f.schedule.features {
        record_weights(r, f, s, group, [map.frames.feature_maps, s.partials], feature_inputs(f, p));
    }
    let chunks = (n as u32).div_ceil(p.chunk);
    let floats = f.parameters.floats as u32;
    r.dispatch_1d(
        &REDUCE_PARTIALS,
        &ReducePartialsParams { rows: chunks, columns: floats, row: floats, offset: 0 },
        &[s.partials, f.parameters.gradient],
        floats as usize,
    );
    let row = map.classes * 17;
    record_weights(r, f, s, &f.schedule.head, [s.raw, s.head_partials], TokenParams { row, ..p });
    r.dispatch_1d(
        &REDUCE_PARTIALS,
        &ReducePartialsParams { rows: chunks, columns: row, row, offset: HEAD_FLOATS as u32 },
        &[s.head_partials, map.decoders.gradient],
        row as usize,
    );
}

/// One training step of the fusion (and the class head) on a stored frame.
pub fn record_step(r: &mut Recording, map: &mut Map, scratch: &Scratch, slot: u32, rate_head: f64) {
    record_backward(r, map, scratch, slot);
    let Some(f) = &mut map.fusion else { return };
    f.step += 1;
    let (floats, rate) = (0..f.parameters.floats, f.config.rate);
    let step = AdamStep { floats, quanta: None, rate, number: f.step };
    f.parameters.record_adam(r, map.status, step);
    let floats = HEAD_FLOATS..HEAD_FLOATS + map.classes as usize * 17;
    let step = AdamStep { floats, quanta: None, rate: rate_head, number: map.step + f.step };
    map.decoders.record_adam(r, map.status, step);
}

fn record_tokens(r: &mut Recording, map: &Map, scratch: &Scratch, slot: u32, train: bool) {
    let (Some(f), Some(s)) = (&map.fusion, &scratch.fusion) else { return };
    let p = token_params(map, f, slot);
    let n = f.count();
    let inputs = [map.frames.poses, map.frames.color_images, map.frames.depth_images, s.raw];
    r.dispatch_1d(&EXTRACT_TOKENS, &p, &inputs, n);
    if f.config.memory {
        let p = FieldParams { raw_stride: f.raw_stride, ..map.base };
        let inputs = [map.semantic.values, map.decoders.values, s.raw];
        r.dispatch_1d(&RECALL_TOKENS, &p, &inputs, n);
    }
    if let Some(group) = &f.schedule.features {
        record_layers(r, f, s, group, map.frames.feature_maps, feature_inputs(f, p));
    }
    for step in &f.schedule.forward {
        match step {
            Step::Layers(group) => record_layers(r, f, s, group, s.raw, p),
            Step::FirstAttention => record_attention(r, f, s, &first(p)),
            Step::SecondAttention => record_attention(r, f, s, &second(f, p)),
        }
    }
    r.dispatch_1d(&GATE_TOKENS, &p, &[s.tokens], n);
    let color_head = f.layers[f.layers.len() - 1].shape.weights;
    r.dispatch_1d(
        &TOKEN_LOSS,
        &TokenParams { train: u32::from(train), color_head, ..p },
        &[
            f.parameters.values,
            map.decoders.values,
            map.token_class_weights,
            s.raw,
            s.tokens,
            s.token_gradient,
            map.frames.targets,
        ],
        n,
    );
}

/// The feature maps as raw inputs.
fn feature_inputs(f: &Fusion, p: TokenParams) -> TokenParams {
    let channels = f.channels;
    TokenParams { raw_stride: channels, raw_at: p.slot * f.count() as u32 * channels, ..p }
}

fn record_layers(
    r: &mut Recording,
    f: &Fusion,
    s: &FusionScratch,
    group: &Group,
    raw: BufferId,
    p: TokenParams,
) {
    let n = f.count();
    r.dispatch(
        &TOKEN_LAYER,
        &TokenParams { layer: group.first, ..p },
        &[f.schedule.table, f.parameters.values, raw, s.tokens],
        group.workgroups(|l| n * l.quads()),
    );
}

fn record_weights(
    r: &mut Recording,
    f: &Fusion,
    s: &FusionScratch,
    group: &Group,
    buffers: [BufferId; 2],
    p: TokenParams,
) {
    let [raw, partials] = buffers;
    let chunks = f.count().div_ceil(p.chunk as usize);
    r.dispatch(
        &TOKEN_WEIGHTS,
        &TokenParams { layer: group.first, ..p },
        &[f.schedule.table, raw, s.tokens, s.token_gradient, partials],
        group.workgroups(|l| l.weight_jobs() * chunks),
    );
}

fn token_params(map: &Map, f: &Fusion, slot: u32) -> TokenParams {
    let c = map.frames.camera();
    TokenParams {
        columns: f.grid.columns,
        rows: f.grid.rows,
        stride: f.stride,
        raw_stride: f.raw_stride,
        width: c.width,
        height: c.height,
        size: f.grid.token_pixels,
        slot,
        fx: c.fx as f32,
        fy: c.fy as f32,
        cx: c.cx as f32,
        cy: c.cy as f32,
        box_min: f.origin_m,
        depth_unit: map.base.depth_unit,
        classes: map.classes,
        key_stride: f.config.key_stride,
        chunk: (f.count() as u32).div_ceil(CHUNKS),
        row: f.parameters.floats as u32,
        residual: NO_RESIDUAL,
        weight_class: f.config.weight_class as f32,
        weight_color: f.config.weight_color as f32,
        ..TokenParams::default()
    }
}

/// Geometry asks semantics for appearance (paper eqs. 1, 2).
fn first(p: TokenParams) -> TokenParams {
    TokenParams { query: FIRST_AT, output: GUIDED_AT, statistics: STATISTICS_AT, ..p }
}

/// Guided semantics ask appearance (paper eqs. 3, 4).
fn second(f: &Fusion, p: TokenParams) -> TokenParams {
    let residual = if f.config.residual { APPEARANCE_AT } else { NO_RESIDUAL };
    TokenParams {
        query: SECOND_AT,
        output: REFINED_AT,
        statistics: STATISTICS_AT + 1,
        residual,
        ..p
    }
}

fn record_attention(r: &mut Recording, f: &Fusion, s: &FusionScratch, p: &TokenParams) {
    r.dispatch(&ATTEND_TOKENS, p, &[s.tokens], [f.count().div_ceil(TILE) as u32, 1, 1]);
}

fn record_attention_backward(r: &mut Recording, f: &Fusion, s: &FusionScratch, p: &TokenParams) {
    let buffers = [s.tokens, s.token_gradient];
    r.dispatch(&ATTEND_QUERIES, p, &buffers, [f.count().div_ceil(TILE) as u32, 1, 1]);
    r.dispatch(&ATTEND_KEYS, p, &buffers, [p.keys().div_ceil(TILE) as u32, 1, 1]);
}
