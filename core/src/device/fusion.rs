//! Multi-tier feature fusion (paper III-A) on the device: parameters, activations of one frame's
//! token grid, and the recordings of its forward and training passes.
use super::{Device, Trained};
use crate::{
    camera::Camera,
    config::FusionConfig,
    engine::{Engine, EngineError},
    kernels::{
        Kernel,
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
            APPEARANCE_AT, COLOR_AT, DEPTHWISE_AT, FIRST_AT, FUSED_AT, GATE_AT, GEOMETRY_AT,
            GEOMETRY_INPUTS, GUIDED_AT, HIDDEN, HIDDEN_AT, LOCAL_AT, LOGITS_AT, NO_BIAS,
            NO_RESIDUAL, PATCH_INPUTS, RAW_GEOMETRY, RAW_HISTOGRAM, RAW_PATCH, REFINED_AT,
            SECOND_AT, SEMANTIC_AT, STATISTICS_AT, TILE, TokenParams,
        },
    },
    layout::{FieldParams, HEAD_FLOATS, TARGET_FLOATS},
    recording::{BufferId, Recording},
};
use alloc::{vec, vec::Vec};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// One layer of the fusion.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// What it is called in the paper or the design.
    pub name: &'static str,
    from_raw: bool,
    input: u32,
    inputs: u32,
    output: u32,
    outputs: u32,
    taps: u32,
    depthwise: bool,
    activation: bool,
    /// First weight in the parameter buffer.
    pub weights: u32,
    /// First bias in the parameter buffer, or `NO_BIAS`.
    pub bias: u32,
    /// Outputs a row of weights has room for.
    room: u32,
}

impl Layer {
    /// Number of weights.
    pub fn weight_count(&self) -> u32 {
        self.taps * self.taps * self.inputs * if self.depthwise { 1 } else { self.room }
    }
    /// Number of biases.
    pub fn bias_count(&self) -> u32 {
        if self.bias == NO_BIAS { 0 } else { self.room }
    }
}

/// Layers in the order of the forward pass; names of `LAYERS` index it.
fn layers(classes: u32, config: &FusionConfig) -> (Vec<Layer>, u32) {
    let mut at = 0;
    let mut all = Vec::new();
    let mut add =
        |name, from_raw, input, inputs, output, outputs: u32, taps, kind: (bool, bool, bool)| {
            let (depthwise, activation, biased) = kind;
            // `token_loss` reads the colour head four columns wide; layers have no padding.
            let room = if name == "colour head" { 4 } else { outputs };
            let mut layer = Layer {
                name,
                from_raw,
                input,
                inputs,
                output,
                outputs,
                taps,
                depthwise,
                activation,
                weights: at,
                bias: NO_BIAS,
                room,
            };
            at += layer.weight_count();
            if biased {
                layer.bias = at;
                at += layer.bias_count();
            }
            all.push(layer);
        };
    let (plain, linear) = ((false, false, false), (false, false, true));
    let local = config.local_kernel;
    add(
        "geometry hidden",
        true,
        RAW_GEOMETRY,
        GEOMETRY_INPUTS,
        HIDDEN_AT,
        HIDDEN,
        1,
        (false, true, true),
    );
    add("geometry", false, HIDDEN_AT, HIDDEN, GEOMETRY_AT, 16, 1, linear);
    add("class embedding", true, RAW_HISTOGRAM, classes, SEMANTIC_AT, 16, 1, plain);
    add("patch embedding", true, RAW_PATCH, PATCH_INPUTS, APPEARANCE_AT, 16, 1, linear);
    add("Q1", false, GEOMETRY_AT, 16, FIRST_AT, 16, 1, plain);
    add("K1", false, SEMANTIC_AT, 16, FIRST_AT + 16, 16, 1, plain);
    add("V1", false, APPEARANCE_AT, 16, FIRST_AT + 32, 16, 1, plain);
    add("Q2", false, GUIDED_AT, 16, SECOND_AT, 16, 1, plain);
    add("K2", false, APPEARANCE_AT, 16, SECOND_AT + 16, 16, 1, plain);
    add("V2", false, APPEARANCE_AT, 16, SECOND_AT + 32, 16, 1, plain);
    add("depthwise", false, GUIDED_AT, 16, DEPTHWISE_AT, 16, 3, (true, true, true));
    let input = if config.local { DEPTHWISE_AT } else { GUIDED_AT };
    add("pointwise", false, input, 16, LOCAL_AT, 16, local, (false, true, true));
    add("gate", false, GEOMETRY_AT, 48, GATE_AT, 3, config.gate_kernel, linear);
    add("colour head", false, FUSED_AT, 16, COLOR_AT, 3, 1, linear);
    (all, at)
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
    /// Origin of the encoded positions: it must not move when the map grows.
    origin_m: [f32; 4],
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
        seed: u32,
    ) -> Result<Fusion, EngineError> {
        let (columns, rows) = grid(camera, config);
        let tokens = (columns * rows) as usize;
        let padded = classes.next_multiple_of(4);
        let (stride, raw_stride) = (LOGITS_AT + padded, RAW_HISTOGRAM + padded);
        let (layers, floats) = layers(classes, config);
        let fusion = Fusion {
            parameters: Trained::new(e, "fusion", floats as usize)?,
            columns,
            rows,
            tokens: e.create_buffer("tokens", tokens * stride as usize)?,
            token_gradient: e.create_buffer("token gradients", tokens * stride as usize)?,
            stride,
            config: config.clone(),
            origin_m,
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
            let inputs = match layer.name {
                "class embedding" => 1,
                _ if layer.depthwise => 9,
                _ => layer.inputs * layer.taps * layer.taps,
            };
            let gain = if layer.name == "gate" { 0.3 } else { 1.4 };
            let limit = gain * (3.0 / inputs as f32).sqrt();
            for i in layer.weights..layer.weights + layer.weight_count() {
                let unused =
                    layer.room > layer.outputs && (i - layer.weights) % layer.room >= layer.outputs;
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
        let used = self.layers.iter().filter(|l| self.config.local || l.name != "depthwise");
        used.map(|l| {
            let outputs = if l.depthwise { 1 } else { l.outputs };
            let biases = if l.bias == NO_BIAS { 0 } else { l.outputs };
            (l.taps * l.taps * l.inputs * outputs + biases) as usize
        })
        .sum()
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
            bias: NO_BIAS,
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
        for layer in &f.layers {
            if layer.name == "colour head" || (layer.name == "depthwise" && !f.config.local) {
                continue;
            }
            if layer.name == "Q2" {
                record_attention(r, f, &ATTEND_TOKENS, &first(f, p), n);
            }
            if layer.name == "depthwise" || (layer.name == "pointwise" && !f.config.local) {
                record_attention(r, f, &ATTEND_TOKENS, &second(f, p), n);
            }
            r.dispatch_1d(
                &TOKEN_LAYER,
                &layer_params(layer, p),
                &[f.parameters.values, f.raw, f.tokens],
                n * layer.outputs.div_ceil(4) as usize,
            );
        }
        r.dispatch_1d(&GATE_TOKENS, &p, &[f.tokens], n);
        let color_head = f.layers[f.layers.len() - 1].weights;
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
        for layer in f.layers.iter().rev() {
            if layer.name == "depthwise" && !f.config.local {
                record_attention_backward(r, f, &second(f, p));
                continue;
            }
            if layer.name == "V2" && f.config.local {
                record_attention_backward(r, f, &second(f, p));
            }
            if layer.name == "V1" {
                record_attention_backward(r, f, &first(f, p));
            }
            let p = layer_params(layer, p);
            let taps = (layer.taps * layer.taps) as usize;
            let quads = layer.outputs.div_ceil(4) as usize;
            let jobs = taps * layer.inputs as usize * if layer.depthwise { 1 } else { quads }
                + if layer.bias == NO_BIAS { 0 } else { quads };
            r.dispatch_1d(
                &TOKEN_WEIGHTS,
                &p,
                &[f.raw, f.tokens, f.token_gradient, f.partials],
                jobs * n.div_ceil(p.chunk as usize),
            );
            // The loss has already sent the colour head's gradient on to F.
            if !layer.from_raw && layer.name != "colour head" {
                r.dispatch_1d(
                    &TOKEN_LAYER_BACKWARD,
                    &p,
                    &[f.parameters.values, f.tokens, f.token_gradient],
                    n * layer.inputs as usize,
                );
            }
        }
        let chunks = (n as u32).div_ceil(p.chunk);
        let floats = f.parameters.floats as u32;
        r.dispatch_1d(
            &REDUCE_PARTIALS,
            &ReducePartialsParams { rows: chunks, columns: floats, row: floats, offset: 0 },
            &[f.partials, f.parameters.gradient],
            floats as usize,
        );
        // The class head is shared with the field; its weights are stored output-major.
        let row = self.classes * 17;
        let head = TokenParams {
            input: FUSED_AT,
            inputs: 16,
            output: LOGITS_AT,
            outputs: self.classes,
            taps: 1,
            bias: self.classes * 16,
            row,
            input_stride: 1,
            output_stride: 16,
            ..p
        };
        r.dispatch_1d(
            &TOKEN_WEIGHTS,
            &head,
            &[f.raw, f.tokens, f.token_gradient, f.head_partials],
            17 * self.classes.div_ceil(4) as usize * chunks as usize,
        );
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

fn layer_params(layer: &Layer, p: TokenParams) -> TokenParams {
    TokenParams {
        from_raw: u32::from(layer.from_raw),
        input: layer.input,
        inputs: layer.inputs,
        output: layer.output,
        outputs: layer.outputs,
        taps: layer.taps,
        depthwise: u32::from(layer.depthwise),
        activation: u32::from(layer.activation),
        weights: layer.weights,
        bias: layer.bias,
        input_stride: layer.room,
        output_stride: 1,
        ..p
    }
}

/// Geometry asks semantics for appearance (paper eqs. 1, 2).
fn first(_: &Fusion, p: TokenParams) -> TokenParams {
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

fn record_attention(
    r: &mut Recording,
    f: &Fusion,
    kernel: &'static Kernel,
    p: &TokenParams,
    n: usize,
) {
    r.dispatch(kernel, p, &[f.tokens], [n.div_ceil(TILE) as u32, 1, 1]);
}

fn record_attention_backward(r: &mut Recording, f: &Fusion, p: &TokenParams) {
    let buffers = [f.tokens, f.token_gradient];
    r.dispatch(&ATTEND_QUERIES, p, &buffers, [f.count().div_ceil(TILE) as u32, 1, 1]);
    r.dispatch(&ATTEND_KEYS, p, &buffers, [p.keys().div_ceil(TILE) as u32, 1, 1]);
}
