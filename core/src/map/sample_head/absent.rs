//! What a build without the per-sample class head has in its place: no head can be made, and its
//! passes record nothing.
use crate::{
    commands::Commands,
    engine::{Engine, EngineError},
    layout::FieldParams,
    map::{Map, ParameterTensor, Rates, Scratch},
};
use alloc::vec::Vec;
use core::convert::Infallible;

/// The per-sample class head, which this build does not have.
pub struct SampleHead {
    /// Weights and biases of all layers.
    pub parameters: ParameterTensor,
    _never: Infallible,
}

/// Activations and gradients of the head, which this build does not have.
pub(crate) struct SampleScratch {
    _never: Infallible,
}

impl SampleHead {
    /// No head.
    #[expect(clippy::unnecessary_wraps, reason = "as where there is one")]
    pub(in crate::map) fn new(
        _: &mut Engine,
        _classes: u32,
        _seed: u32,
    ) -> Result<Option<SampleHead>, EngineError> {
        Ok(None)
    }
}

impl SampleScratch {
    /// Never called: there is no head.
    pub(in crate::map) fn new(
        _: &mut Engine,
        head: &SampleHead,
        _classes: u32,
        _trained: usize,
        _rays: usize,
    ) -> Result<SampleScratch, EngineError> {
        match head._never {}
    }
}

/// Nothing.
pub(in crate::map) fn record_classes(_: &mut Commands, _: &Map, _: &Scratch, _: &FieldParams) {}

/// Nothing.
pub(in crate::map) fn record_backward(_: &mut Commands, _: &Map, _: &Scratch, _: &FieldParams) {}

/// Nothing.
pub(in crate::map) fn record_step(_: &mut Commands, _: &Map, _: Rates, _number: u32) {}

/// No classes: nobody asks without a head.
pub(in crate::map) async fn classes_at(
    _: &mut Engine,
    _: &Map,
    _: &Scratch,
    _: &[[f32; 4]],
) -> Result<Vec<u32>, EngineError> {
    Ok(Vec::new())
}
