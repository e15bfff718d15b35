//! What gives a pixel or a vertex its class.
use super::Slam;
use crate::config::Inference;

impl Slam {
    /// Whether any pixel that the map has been trained with had a class; otherwise its classes
    /// mean nothing.
    pub fn labelled(&self) -> bool {
        self.class_counts.any()
    }

    /// Whether there is a redundancy suppressor.
    pub(super) fn has_anchors(&self) -> bool {
        self.map.as_ref().is_some_and(|m| m.suppressor.is_some())
    }

    /// Takes the classes of views and meshes from the head, or from anchors that have settled, from
    /// now on. Its checkpoints are then those of such a run.
    pub fn set_inference(&mut self, inference: Inference) {
        self.config.suppressor.inference = inference;
    }

    /// Whether the last optimisation is complete, and there are anchors: they give the classes from
    /// then on, if so configured.
    pub fn anchors_settled(&self) -> bool {
        self.has_anchors() && self.finished_iterations == self.finish_plan().iterations()
    }

    /// Whether classes of views and meshes are now those of the nearest anchors, not the head's.
    pub fn classes_by_anchors(&self) -> bool {
        self.config.suppressor.inference == Inference::Anchors && self.anchors_settled()
    }
}
