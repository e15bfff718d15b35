//! Multi-tier feature fusion (paper III-A): its parameters, and the activations of one frame's
//! tokens.
mod layers;
mod passes;

pub use layers::FusionLayer;
pub use passes::{record_backward, record_forward, record_step};

use super::{ParameterTensor, TokenGrid};
use crate::{
    commands::{Buffer, Commands},
    config::FusionConfig,
    engine::{Engine, EngineError},
    kernels::{
        shared::random_f32,
        tokens::{LOGITS_AT, NO_BIAS, RAW_HISTOGRAM},
    },
};
use alloc::{vec, vec::Vec};
use layers::{Schedule, layers};
use mte_slam_shaders::random::{first_values, salt};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Rows of partial gradients.
const CHUNKS: u32 = 16;

/// The parameters of the fusion, and how its layers are run.
pub struct Fusion {
    /// All learned parameters of the fusion (the class head is the field's).
    pub parameters: ParameterTensor,
    /// Layers in the order of the forward pass.
    pub layers: Vec<FusionLayer>,
    /// The grid of tokens over a frame.
    pub grid: TokenGrid,
    /// Floats of a token's activations.
    pub stride: u32,
    /// Floats of a token's inputs.
    raw_stride: u32,
    config: FusionConfig,
    /// Channels of feature maps; 0 without.
    channels: u32,
    /// Origin of the encoded positions: it must not move when the map grows.
    origin_m: [f32; 4],
    schedule: Schedule,
    step: u32,
}

/// Activations and gradients of the last frame that went through the fusion.
pub struct FusionScratch {
    /// Activations.
    pub tokens: Buffer<f32>,
    /// Gradients of the last training pass.
    pub token_gradient: Buffer<f32>,
    raw: Buffer<f32>,
    partials: Buffer<f32>,
    head_partials: Buffer<f32>,
}

impl FusionScratch {
    pub(super) fn new(
        e: &mut Engine,
        fusion: &Fusion,
        classes: u32,
    ) -> Result<FusionScratch, EngineError> {
        let tokens = fusion.grid.tokens();
        let (stride, raw_stride) = (fusion.stride as usize, fusion.raw_stride as usize);
        let partials = CHUNKS as usize * fusion.parameters.floats;
        Ok(FusionScratch {
            tokens: e.create("tokens", tokens * stride)?,
            token_gradient: e.create("token gradients", tokens * stride)?,
            raw: e.create("raw tokens", tokens * raw_stride)?,
            partials: e.create("fusion partials", partials)?,
            head_partials: e.create("head partials", (CHUNKS * classes * 17) as usize)?,
        })
    }
}

impl Fusion {
    pub(super) fn new(
        e: &mut Engine,
        config: &FusionConfig,
        origin_m: [f32; 4],
        grid: TokenGrid,
        classes: u32,
        channels: u32,
        seed: u32,
    ) -> Result<Fusion, EngineError> {
        let padded = classes.next_multiple_of(4);
        let (layers, floats) = layers(classes, channels, config);
        let schedule = Schedule::new(e, &layers, classes, config)?;
        let fusion = Fusion {
            parameters: ParameterTensor::new(e, "fusion", floats as usize)?,
            grid,
            stride: LOGITS_AT + padded,
            raw_stride: RAW_HISTOGRAM + padded,
            config: config.clone(),
            channels,
            origin_m,
            schedule,
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
                    w[i as usize] = (2.0 * random_f32(seed, first_values::FUSION, i, salt::FUSION)
                        - 1.0)
                        * limit;
                }
            }
        }
        let mut r = Commands::default();
        r.upload(fusion.parameters.values, 0, &w);
        e.submit(&r)?;
        Ok(fusion)
    }

    /// Parameters that training moves: no padding, nor layers that the configuration leaves out.
    pub(crate) fn trained_count(&self) -> usize {
        let used = self.layers.iter().filter(|l| l.used(&self.config));
        used.map(|layer| {
            let l = &layer.shape;
            let outputs = if l.depthwise == 1 { 1 } else { l.outputs };
            let biases = if l.bias == NO_BIAS { 0 } else { l.outputs };
            (l.taps * l.taps * l.inputs * outputs + biases) as usize
        })
        .sum()
    }

    /// Tokens of a frame.
    pub fn count(&self) -> usize {
        self.grid.tokens()
    }

    /// Training steps so far.
    pub fn steps(&self) -> u32 {
        self.step
    }

    /// Steps taken, and the origin of encoded positions.
    pub(super) fn progress(&self) -> (u32, [f32; 4]) {
        (self.step, self.origin_m)
    }

    /// Sets what [`Fusion::progress`] returns.
    pub(super) fn set_progress(&mut self, step: u32, origin_m: [f32; 4]) {
        (self.step, self.origin_m) = (step, origin_m);
    }
}
