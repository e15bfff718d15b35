//! Parameter tensors, and Adam's steps on them.
use crate::{
    commands::{Buffer, Commands},
    engine::{Engine, EngineError},
    kernels::adam::{self, AdamParams},
};
use core::ops::Range;

/// A parameter tensor with its gradient and Adam's moments.
#[derive(Clone, Copy, Debug)]
pub struct ParameterTensor {
    /// Values. Kernels read planes and decoders by fours, everything else by floats.
    pub values: Buffer<[f32; 4]>,
    /// Gradients: fixed-point i32 for planes, f32 for decoders.
    pub gradient: Buffer<i32>,
    /// First moments.
    pub moment1: Buffer<f32>,
    /// Second moments.
    pub moment2: Buffer<f32>,
    /// Number of floats.
    pub floats: usize,
}

impl ParameterTensor {
    pub(super) fn new(
        engine: &mut Engine,
        name: &'static str,
        floats: usize,
    ) -> Result<ParameterTensor, EngineError> {
        Ok(ParameterTensor {
            values: engine.create(name, floats)?,
            gradient: engine.create(name, floats)?,
            moment1: engine.create(name, floats)?,
            moment2: engine.create(name, floats)?,
            floats,
        })
    }

    pub(super) fn destroy(&self, engine: &mut Engine) {
        engine.destroy_buffer(self.values);
        engine.destroy_buffer(self.gradient);
        engine.destroy_buffer(self.moment1);
        engine.destroy_buffer(self.moment2);
    }

    /// Records a step of Adam, which leaves parameters without gradient alone.
    pub(super) fn record_adam(&self, r: &mut Commands, status: Buffer<u32>, step: AdamStep) {
        let correction = |beta: f64| {
            let steps = step.number.min(1 << 20) as i32;
            (1.0 / (1.0 - num_traits::Float::powi(beta, steps))) as f32
        };
        adam::record(
            r,
            &AdamParams {
                offset: step.floats.start as u32,
                count: step.floats.len() as u32,
                fixed_point: u32::from(step.quanta.is_some()),
                gradient_limit: 1 << 30,
                gradient_scale: step.quanta.map_or(1.0, |q| 1.0 / q),
                learning_rate: step.rate as f32,
                beta1: 0.9,
                beta2: 0.999,
                epsilon: 1e-15,
                correction1: correction(0.9),
                correction2: correction(0.999),
            },
            adam::Buffers {
                parameters: self.values.floats(),
                gradient: self.gradient.cast(),
                moment1: self.moment1,
                moment2: self.moment2,
                status,
            },
        );
    }
}

/// A step of Adam on a part of a tensor.
pub(super) struct AdamStep {
    /// The part.
    pub floats: Range<usize>,
    /// Quanta per unit of a gradient in fixed point; `None` for floating point.
    pub quanta: Option<f32>,
    /// Learning rate.
    pub rate: f64,
    /// Which step it is, from 1 on.
    pub number: u32,
}
