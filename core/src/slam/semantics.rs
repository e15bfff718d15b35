//! What mapping does for semantics beside rays: class weights, fusion steps, anchors by stage.
use super::Slam;
use crate::{
    config::{FusionConfig, Inference, SuppressorConfig},
    frame::Frame,
};
use alloc::vec::Vec;

/// Classes never weigh more than this against the mean pixel.
const MAX_CLASS_WEIGHT: f64 = 10.0;

/// How often each class was seen, over all mapped frames.
#[derive(Clone, Debug, Default)]
pub(super) struct ClassCounts(pub Vec<f64>);

impl ClassCounts {
    /// Adds a frame's labels.
    pub fn add(&mut self, classes: usize, frame: &Frame) {
        self.0.resize(classes, 0.0);
        for label in frame.labels.iter().flatten() {
            if let Some(n) = self.0.get_mut(*label as usize) {
                *n += 1.0;
            }
        }
    }

    /// Whether there was any label.
    pub fn any(&self) -> bool {
        self.0.iter().any(|n| *n > 0.0)
    }

    /// Weights by inverse frequency to the power of `balance`; the mean pixel weighs 1.
    pub fn weights(&self, balance: f64) -> Vec<f32> {
        let total: f64 = self.0.iter().sum();
        let raw: Vec<f64> = self.0.iter().map(|n| libm::pow(total / n.max(1.0), balance)).collect();
        let mean = raw.iter().zip(&self.0).map(|(w, n)| w * n).sum::<f64>() / total.max(1.0);
        raw.iter().map(|w| (w / mean.max(1e-9)).min(MAX_CLASS_WEIGHT) as f32).collect()
    }

    /// How rare each class is: one over its pixels.
    pub fn rarity(&self) -> Vec<f32> {
        self.0.iter().map(|n| (1.0 / n.max(1.0)) as f32).collect()
    }
}

/// Training steps of the fusion that are due in `count` iterations from the `first` on, of `steps`
/// spread over `iterations`.
pub(super) fn steps_due(steps: u32, iterations: u32, first: u32, count: u32) -> u32 {
    let until = |i: u32| u64::from(i) * u64::from(steps) / u64::from(iterations.max(1));
    (until(first + count) - until(first)) as u32
}

impl Slam {
    /// Whether any pixel that the map has learnt from had a class; without, its classes mean
    /// nothing.
    pub fn labelled(&self) -> bool {
        self.class_counts.any()
    }

    /// Whether there is a redundancy suppressor.
    pub(super) fn has_anchors(&self) -> bool {
        self.device.as_ref().is_some_and(|d| d.suppressor.is_some())
    }

    /// Takes the classes of views and meshes from the head, or from anchors that have settled, from
    /// now on. Its checkpoints are then those of such a run.
    pub fn set_inference(&mut self, inference: Inference) {
        self.config.suppressor.inference = inference;
    }

    /// Whether the last optimisation is complete, and there are anchors: they tell classes from then
    /// on, if so configured.
    pub fn anchors_settled(&self) -> bool {
        self.has_anchors() && self.finished_iterations == self.finish_iterations()
    }

    /// Whether classes of views and meshes are now those of the nearest anchors, not the head's.
    pub fn classes_by_anchors(&self) -> bool {
        self.config.suppressor.inference == Inference::Anchors && self.anchors_settled()
    }

    /// Weight of the compression loss by stage: features must have settled before they are held.
    pub(super) fn compression(&self, c: &SuppressorConfig) -> f64 {
        let since = f64::from(self.mapping_calls) - f64::from(c.start);
        if since < 0.0 { 0.0 } else { c.weight * (since / f64::from(c.ramp.max(1))).min(1.0) }
    }

    /// Weight of the feature loss: the fusion must have been trained on one frame.
    pub(super) fn feature(&self, c: &FusionConfig) -> f64 {
        if self.mapping_calls == 0 { 0.0 } else { c.weight }
    }
}
