//! Parameter tensors, and Adam's steps on them.
use crate::{
    engine::{Engine, EngineError},
    kernels::adam::{self, AdamParams},
    recording::{BufferId, Recording},
};
use core::ops::Range;

/// A parameter tensor with its gradient and Adam's moments.
#[derive(Clone, Copy, Debug)]
pub struct ParameterTensor {
    /// Values.
    pub values: BufferId,
    /// Gradients: fixed-point i32 for planes, f32 for decoders.
    pub gradient: BufferId,
    /// First moments.
    pub moment1: BufferId,
    /// Second moments.
    pub moment2: BufferId,
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
            values: engine.create_buffer(name, floats)?,
            gradient: engine.create_buffer(name, floats)?,
            moment1: engine.create_buffer(name, floats)?,
            moment2: engine.create_buffer(name, floats)?,
            floats,
        })
    }

    pub(super) fn destroy(&self, engine: &mut Engine) {
        for b in [self.values, self.gradient, self.moment1, self.moment2] {
            engine.destroy_buffer(b);
        }
    }

    /// Records a step of Adam, which leaves parameters without gradient alone.
    pub(super) fn record_adam(&self, r: &mut Recording, status: BufferId, step: AdamStep) {
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
            &[self.values, self.gradient, self.moment1, self.moment2, status],
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
