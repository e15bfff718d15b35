//! Multi-tier feature fusion (paper III-A) on the device: parameters, activations of one frame's
//! token grid, and the recordings of its forward and training passes.
mod layers;

pub use layers::Layer;

use super::{Device, Trained};
use crate::{
    camera::Camera,
    config::FusionConfig,
    engine::{Engine, EngineError},
    frame::FeatureMap,
    kernels::{
        adam::{self, AdamParams},
        attend_keys::ATTEND_KEYS,
        attend_queries::ATTEND_QUERIES,
        attend_tokens::ATTEND_TOKENS,
        extract_tokens::EXTRACT_TOKENS,
        gate_backward::GATE_BACKWARD,
        gate_tokens::GATE_TOKENS,
        recall_tokens::RECALL_TOKENS,
        reduce_partials::{REDUCE_PARTIALS, ReducePartialsParams},
        shared::random_f32,
        token_layer::TOKEN_LAYER,
        token_layer_backward::TOKEN_LAYER_BACKWARD,
        token_loss::TOKEN_LOSS,
        token_weights::TOKEN_WEIGHTS,
        tokens::{
            APPEARANCE_AT, FIRST_AT, GUIDED_AT, LOGITS_AT, NO_BIAS, NO_RESIDUAL, RAW_HISTOGRAM,
            REFINED_AT, SECOND_AT, STATISTICS_AT, TILE, TokenParams,
        },
    },
    layout::{FieldParams, HEAD_FLOATS, TARGET_FLOATS},
    recording::{BufferId, Recording},
};
use alloc::{vec, vec::Vec};
use layers::{Group, Schedule, Step, layers};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Feature maps of the stored frames, on the token grid.
#[derive(Clone, Copy, Debug)]
pub struct FeatureMaps {
    /// Channels, 0 without feature maps.
    pub channels: u32,
    /// Channels of each token of each slot.
    pub buffer: BufferId,
}

/// Buffers of the fusion.
pub struct Fusion {
    /// All learned parameters of the fusion (the class head is the field's).
    pub parameters: Trained,
    /// Layers in the order of the forward pass.
    pub layers: Vec<Layer>,
    /// Columns of the token grid.
    pub columns: u32,
    /// Rows of the token grid.
    pub rows: u32,
    /// Activations of the last frame.
    pub tokens: BufferId,
    /// Gradients of the last training pass.
    pub token_gradient: BufferId,
    /// Floats a token's activations take.
    pub stride: u32,
    config: FusionConfig,
    maps: FeatureMaps,
    /// Origin of the encoded positions: it must not move when the map grows.
    origin_m: [f32; 4],
    schedule: Schedule,
    raw: BufferId,
    raw_stride: u32,
    partials: BufferId,
    head_partials: BufferId,
    step: u32,
}

/// Rows of partial gradients.
const CHUNKS: u32 = 16;

impl Fusion {
    pub(super) fn new(
        e: &mut Engine,
        config: &FusionConfig,
        origin_m: [f32; 4],
        camera: &Camera,
        classes: u32,
        maps: FeatureMaps,
        seed: u32,
    ) -> Result<Fusion, EngineError> {
        let (columns, rows) = grid(camera, config);
        let tokens = (columns * rows) as usize;
        let padded = classes.next_multiple_of(4);
        let (stride, raw_stride) = (LOGITS_AT + padded, RAW_HISTOGRAM + padded);
        let (layers, floats) = layers(classes, maps.channels, config);
        let schedule = Schedule::new(e, &layers, classes, config)?;
        let fusion = Fusion {
            parameters: Trained::new(e, "fusion", floats as usize)?,
            columns,
            rows,
            tokens: e.create_buffer("tokens", tokens * stride as usize)?,
            token_gradient: e.create_buffer("token gradients", tokens * stride as usize)?,
            stride,
            config: config.clone(),
            maps,
            origin_m,
            schedule,
            raw: e.create_buffer("raw tokens", tokens * raw_stride as usize)?,
            raw_stride,
            partials: e.create_buffer("fusion partials", (CHUNKS * floats) as usize)?,
            head_partials: e.create_buffer("head partials", (CHUNKS * classes * 17) as usize)?,
            step: 0,
            layers,
        };
        let mut w = vec![0.0_f32; floats as usize];
        for layer in &fusion.layers {
            // A histogram has one input in effect: its embedding is not scaled down by the classes.
            let l = &layer.shape;
            let inputs = match layer.name {
                "class embedding" => 1,
                _ if l.depthwise == 1 => 9,
                _ => l.inputs * l.taps * l.taps,
            };
            let gain = if layer.name == "gate" { 0.3 } else { 1.4 };
            let limit = gain * (3.0 / inputs as f32).sqrt();
            for i in l.weights..l.weights + l.weight_count() {
                let unused =
                    l.input_stride > l.outputs && (i - l.weights) % l.input_stride >= l.outputs;
                if !unused {
                    w[i as usize] = (2.0 * random_f32(seed, 0x1720, i, 9) - 1.0) * limit;
                }
            }
        }
        let mut r = Recording::default();
        r.upload(fusion.parameters.values, 0, &w);
        e.submit(&r)?;
        Ok(fusion)
    }

    /// Parameters that training moves: no padding, nor layers that the configuration leaves out.
    pub fn trained_count(&self) -> usize {
        let used = self.layers.iter().filter(|l| l.used(&self.config));
        used.map(|layer| {
            let l = &layer.shape;
            let outputs = if l.depthwise == 1 { 1 } else { l.outputs };
            let biases = if l.bias == NO_BIAS { 0 } else { l.outputs };
            (l.taps * l.taps * l.inputs * outputs + biases) as usize
        })
        .sum()
    }

    /// Puts a frame's feature map on the token grid of a slot.
    pub(super) fn upload_features(
        &self,
        r: &mut Recording,
        slot: u32,
        map: &FeatureMap,
        camera: &Camera,
    ) {
        if map.channels != self.maps.channels as usize {
            return;
        }
        // Pixels right of and below the last whole token belong to none.
        let covered = |tokens: u32, pixels: u32| {
            (tokens * self.config.token_pixels) as f32 / pixels.max(1) as f32
        };
        let extent = [covered(self.columns, camera.width), covered(self.rows, camera.height)];
        let values = map.resampled(self.columns as usize, self.rows as usize, extent);
        r.upload(self.maps.buffer, slot as usize * values.len(), &values);
    }

    /// The feature maps as raw inputs.
    fn feature_inputs(&self, p: TokenParams) -> TokenParams {
        let channels = self.maps.channels;
        TokenParams { raw_stride: channels, raw_at: p.slot * self.count() as u32 * channels, ..p }
    }

    fn record_layers(&self, r: &mut Recording, group: &Group, raw: BufferId, p: TokenParams) {
        let n = self.count();
        r.dispatch(
            &TOKEN_LAYER,
            &TokenParams { layer: group.first, ..p },
            &[self.schedule.table, self.parameters.values, raw, self.tokens],
            group.workgroups(|l| n * l.quads()),
        );
    }

    fn record_weights(
        &self,
        r: &mut Recording,
        group: &Group,
        buffers: [BufferId; 2],
        p: TokenParams,
    ) {
        let [raw, partials] = buffers;
        let chunks = self.count().div_ceil(p.chunk as usize);
        r.dispatch(
            &TOKEN_WEIGHTS,
            &TokenParams { layer: group.first, ..p },
            &[self.schedule.table, raw, self.tokens, self.token_gradient, partials],
            group.workgroups(|l| l.weight_jobs() * chunks),
        );
    }

    /// Tokens of a frame.
    pub fn count(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// Floats of one slot's targets.
    pub(super) fn target_floats(&self) -> usize {
        self.count() * TARGET_FLOATS
    }

    /// Steps taken, and the origin of encoded positions.
    pub(super) fn progress(&self) -> (u32, [f32; 4]) {
        (self.step, self.origin_m)
    }

    /// Sets what [`Fusion::progress`] tells.
    pub(super) fn set_progress(&mut self, step: u32, origin_m: [f32; 4]) {
        (self.step, self.origin_m) = (step, origin_m);
    }
}

/// Columns and rows of the token grid.
pub(super) fn grid(camera: &Camera, config: &FusionConfig) -> (u32, u32) {
    (camera.width / config.token_pixels, camera.height / config.token_pixels)
}

/// Floats of one slot's targets.
pub(super) fn target_floats(camera: &Camera, config: &FusionConfig) -> usize {
    let (columns, rows) = grid(camera, config);
    (columns * rows) as usize * TARGET_FLOATS
}

impl Device {
    /// Training steps of the fusion so far.
    pub fn fusion_steps(&self) -> u32 {
        self.fusion.as_ref().map_or(0, |f| f.step)
    }

    fn token_params(&self, f: &Fusion, slot: u32) -> TokenParams {
        let c = &self.camera;
        TokenParams {
            columns: f.columns,
            rows: f.rows,
            stride: f.stride,
            raw_stride: f.raw_stride,
            width: c.width,
            height: c.height,
            size: f.config.token_pixels,
            slot,
            fx: c.fx as f32,
            fy: c.fy as f32,
            cx: c.cx as f32,
            cy: c.cy as f32,
            box_min: f.origin_m,
            depth_unit: self.base.depth_unit,
            classes: self.classes,
            key_stride: f.config.key_stride,
            chunk: (f.count() as u32).div_ceil(CHUNKS),
            row: f.parameters.floats as u32,
            residual: NO_RESIDUAL,
            weight_class: f.config.weight_class as f32,
            weight_color: f.config.weight_color as f32,
            ..TokenParams::default()
        }
    }

    /// Fused features of a stored frame; they become the targets of its rays.
    pub fn record_fusion_forward(&self, r: &mut Recording, slot: u32) {
        self.record_fusion(r, slot, false);
    }

    fn record_fusion(&self, r: &mut Recording, slot: u32, train: bool) {
        let Some(f) = &self.fusion else { return };
        let p = self.token_params(f, slot);
        let n = f.count();
        let inputs = [self.poses, self.color_images, self.depth_images, f.raw];
        r.dispatch_1d(&EXTRACT_TOKENS, &p, &inputs, n);
        if f.config.memory {
            let p = FieldParams { raw_stride: f.raw_stride, ..self.base };
            let inputs = [self.semantic.values, self.decoders.values, f.raw];
            r.dispatch_1d(&RECALL_TOKENS, &p, &inputs, n);
        }
        if let Some(group) = &f.schedule.features {
            f.record_layers(r, group, f.maps.buffer, f.feature_inputs(p));
        }
        for step in &f.schedule.forward {
            match step {
                Step::Layers(group) => f.record_layers(r, group, f.raw, p),
                Step::FirstAttention => record_attention(r, f, &first(p)),
                Step::SecondAttention => record_attention(r, f, &second(f, p)),
            }
        }
        r.dispatch_1d(&GATE_TOKENS, &p, &[f.tokens], n);
        let color_head = f.layers[f.layers.len() - 1].shape.weights;
        r.dispatch_1d(
            &TOKEN_LOSS,
            &TokenParams { train: u32::from(train), color_head, ..p },
            &[
                f.parameters.values,
                self.decoders.values,
                self.token_class_weights,
                f.raw,
                f.tokens,
                f.token_gradient,
                self.targets,
            ],
            n,
        );
    }

    /// Forward pass, losses and gradients of the fusion on a stored frame; nothing moves yet.
    pub fn record_fusion_backward(&self, r: &mut Recording, slot: u32) {
        let Some(f) = &self.fusion else { return };
        let p = self.token_params(f, slot);
        let n = f.count();
        r.clear(f.token_gradient, 0, n * f.stride as usize);
        self.record_fusion(r, slot, true);
        r.dispatch_1d(&GATE_BACKWARD, &p, &[f.tokens, f.token_gradient], n);
        for step in &f.schedule.backward {
            match step {
                Step::Layers(group) => r.dispatch(
                    &TOKEN_LAYER_BACKWARD,
                    &TokenParams { layer: group.first, ..p },
                    &[f.schedule.table, f.parameters.values, f.tokens, f.token_gradient],
                    group.workgroups(|l| n * l.inputs as usize),
                ),
                Step::FirstAttention => record_attention_backward(r, f, &first(p)),
                Step::SecondAttention => record_attention_backward(r, f, &second(f, p)),
            }
        }
        f.record_weights(r, &f.schedule.weights, [f.raw, f.partials], p);
        if let Some(group) = &f.schedule.features {
            f.record_weights(r, group, [f.maps.buffer, f.partials], f.feature_inputs(p));
        }
        let chunks = (n as u32).div_ceil(p.chunk);
        let floats = f.parameters.floats as u32;
        r.dispatch_1d(
            &REDUCE_PARTIALS,
            &ReducePartialsParams { rows: chunks, columns: floats, row: floats, offset: 0 },
            &[f.partials, f.parameters.gradient],
            floats as usize,
        );
        let row = self.classes * 17;
        f.record_weights(r, &f.schedule.head, [f.raw, f.head_partials], TokenParams { row, ..p });
        r.dispatch_1d(
            &REDUCE_PARTIALS,
            &ReducePartialsParams { rows: chunks, columns: row, row, offset: HEAD_FLOATS as u32 },
            &[f.head_partials, self.decoders.gradient],
            row as usize,
        );
    }

    /// One training step of the fusion (and the class head) on a stored frame.
    pub fn record_fusion_step(&mut self, r: &mut Recording, slot: u32, rate_head: f64) {
        self.record_fusion_backward(r, slot);
        let Some(f) = &mut self.fusion else { return };
        f.step += 1;
        let correction = |beta: f64, step: u32| {
            (1.0 / (1.0 - num_traits::Float::powi(beta, step.clamp(1, 1 << 20) as i32))) as f32
        };
        let step = |offset, count, rate: f64, step| AdamParams {
            offset,
            count,
            fixed_point: 0,
            gradient_limit: 1 << 30,
            gradient_scale: 1.0,
            learning_rate: rate as f32,
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-15,
            correction1: correction(0.9, step),
            correction2: correction(0.999, step),
        };
        let t = &f.parameters;
        adam::record(
            r,
            &step(0, t.floats as u32, f.config.rate, f.step),
            &[t.values, t.gradient, t.moment1, t.moment2, self.status],
        );
        let t = &self.decoders;
        adam::record(
            r,
            &step(HEAD_FLOATS as u32, self.classes * 17, rate_head, self.step + f.step),
            &[t.values, t.gradient, t.moment1, t.moment2, self.status],
        );
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

fn record_attention(r: &mut Recording, f: &Fusion, p: &TokenParams) {
    r.dispatch(&ATTEND_TOKENS, p, &[f.tokens], [f.count().div_ceil(TILE) as u32, 1, 1]);
}

fn record_attention_backward(r: &mut Recording, f: &Fusion, p: &TokenParams) {
    let buffers = [f.tokens, f.token_gradient];
    r.dispatch(&ATTEND_QUERIES, p, &buffers, [f.count().div_ceil(TILE) as u32, 1, 1]);
    r.dispatch(&ATTEND_KEYS, p, &buffers, [p.keys().div_ceil(TILE) as u32, 1, 1]);
}
