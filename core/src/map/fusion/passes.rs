//! The passes of the fusion over a stored frame's tokens.
use super::{
    CHUNKS, Fusion, FusionScratch,
    layers::{Group, Step},
};
use crate::{
    call::Call,
    commands::{Buffer, Commands},
    kernels::{
        attend_keys, attend_queries, attend_tokens, extract_tokens, gate_backward, gate_tokens,
        recall_tokens,
        reduce_partials::{self, ReducePartialsParams},
        token_layer, token_layer_backward, token_loss, token_weights,
        tokens::{
            APPEARANCE_AT, FIRST_AT, GUIDED_AT, NO_RESIDUAL, REFINED_AT, SECOND_AT, STATISTICS_AT,
            TILE, TokenParams,
        },
    },
    layout::{FieldParams, HEAD_FLOATS},
    map::{Map, Scratch, parameters::AdamStep},
};

/// Fused features of a stored frame; they become the targets of its rays. Records nothing without a
/// fusion, as all passes here.
pub fn record_forward(r: &mut Commands, map: &Map, scratch: &Scratch, slot: u32) {
    record_tokens(r, map, scratch, slot, false);
}

/// Forward pass, losses and gradients of the fusion on a stored frame; nothing moves yet.
pub fn record_backward(r: &mut Commands, map: &Map, scratch: &Scratch, slot: u32) {
    let (Some(f), Some(s)) = (&map.fusion, &scratch.fusion) else { return };
    let p = token_params(map, f, slot);
    let n = f.count();
    r.clear(s.token_gradient, 0, n * f.stride as usize);
    record_tokens(r, map, scratch, slot, true);
    gate_backward::Buffers { tokens: s.tokens, token_gradient: s.token_gradient }.record(r, &p, n);
    for step in &f.schedule.backward {
        match step {
            Step::Layers(group) => token_layer_backward::Buffers {
                layers: f.schedule.table,
                parameters: f.parameters.values.floats(),
                tokens: s.tokens,
                token_gradient: s.token_gradient,
            }
            .record_workgroups(
                r,
                &TokenParams { layer: group.first, ..p },
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
    reduce_partials::Buffers { partials: s.partials, gradient: f.parameters.gradient.cast() }
        .record(
            r,
            &ReducePartialsParams { rows: chunks, columns: floats, row: floats, offset: 0 },
            floats as usize,
        );
    let row = map.classes * 17;
    record_weights(r, f, s, &f.schedule.head, [s.raw, s.head_partials], TokenParams { row, ..p });
    reduce_partials::Buffers { partials: s.head_partials, gradient: map.decoders.gradient.cast() }
        .record(
            r,
            &ReducePartialsParams { rows: chunks, columns: row, row, offset: HEAD_FLOATS as u32 },
            row as usize,
        );
}

/// One training step of the fusion (and the class head) on a stored frame.
pub fn record_step(r: &mut Commands, map: &mut Map, scratch: &Scratch, slot: u32, rate_head: f64) {
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

fn record_tokens(r: &mut Commands, map: &Map, scratch: &Scratch, slot: u32, train: bool) {
    let (Some(f), Some(s)) = (&map.fusion, &scratch.fusion) else { return };
    let p = token_params(map, f, slot);
    let n = f.count();
    extract_tokens::Buffers {
        poses: map.frames.poses,
        color_images: map.frames.color_images,
        depth_images: map.frames.depth_images,
        raw: s.raw,
    }
    .record(r, &p, n);
    if f.config.memory {
        let p = FieldParams { raw_stride: f.raw_stride, ..map.base };
        recall_tokens::Buffers {
            planes_semantic: map.semantic.values,
            decoders: map.decoders.values,
            raw: s.raw,
        }
        .record(r, &p, n);
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
    gate_tokens::Buffers { tokens: s.tokens }.record(r, &p, n);
    let color_head = f.layers[f.layers.len() - 1].shape.weights;
    token_loss::Buffers {
        parameters: f.parameters.values.floats(),
        decoders: map.decoders.values.floats(),
        class_weights: map.token_class_weights,
        raw: s.raw,
        tokens: s.tokens,
        token_gradient: s.token_gradient,
        targets: map.frames.targets,
    }
    .record(r, &TokenParams { train: u32::from(train), color_head, ..p }, n);
}

/// The feature maps as raw inputs.
fn feature_inputs(f: &Fusion, p: TokenParams) -> TokenParams {
    let channels = f.channels;
    TokenParams { raw_stride: channels, raw_at: p.slot * f.count() as u32 * channels, ..p }
}

fn record_layers(
    r: &mut Commands,
    f: &Fusion,
    s: &FusionScratch,
    group: &Group,
    raw: Buffer<f32>,
    p: TokenParams,
) {
    let n = f.count();
    token_layer::Buffers {
        layers: f.schedule.table,
        parameters: f.parameters.values.floats(),
        raw,
        tokens: s.tokens,
    }
    .record_workgroups(
        r,
        &TokenParams { layer: group.first, ..p },
        group.workgroups(|l| n * l.quads()),
    );
}

fn record_weights(
    r: &mut Commands,
    f: &Fusion,
    s: &FusionScratch,
    group: &Group,
    buffers: [Buffer<f32>; 2],
    p: TokenParams,
) {
    let [raw, partials] = buffers;
    let chunks = f.count().div_ceil(p.chunk as usize);
    token_weights::Buffers {
        layers: f.schedule.table,
        raw,
        tokens: s.tokens,
        token_gradient: s.token_gradient,
        partials,
    }
    .record_workgroups(
        r,
        &TokenParams { layer: group.first, ..p },
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

fn record_attention(r: &mut Commands, f: &Fusion, s: &FusionScratch, p: &TokenParams) {
    attend_tokens::Buffers { tokens: s.tokens }.record_workgroups(
        r,
        p,
        [f.count().div_ceil(TILE) as u32, 1, 1],
    );
}

fn record_attention_backward(r: &mut Commands, f: &Fusion, s: &FusionScratch, p: &TokenParams) {
    attend_queries::Buffers { tokens: s.tokens, token_gradient: s.token_gradient }
        .record_workgroups(r, p, [f.count().div_ceil(TILE) as u32, 1, 1]);
    attend_keys::Buffers { tokens: s.tokens, token_gradient: s.token_gradient }.record_workgroups(
        r,
        p,
        [p.keys().div_ceil(TILE) as u32, 1, 1],
    );
}
