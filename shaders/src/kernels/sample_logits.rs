//! Class logits of a ray's samples: composited, their loss, its gradients.
use crate::rays::Ray;

shared_struct! {
    /// Parameters of `sample_logits`.
    pub struct SampleLogitsParams {
        /// Rays of this part of the batch.
        rays: u32,
        /// The first of them.
        first_ray: u32,
        /// Rays of the whole batch.
        batch_rays: u32,
        /// Slots of samples per ray.
        slots: u32,
        /// Classes.
        classes: u32,
        /// 1: write the gradients.
        train: u32,
        /// Weight of the cross-entropy.
        weight_semantic: f32,
    }
}

interface! {
    /// Composites logits (the weights are constants), scores them, and puts their gradients in
    /// their place.
    pub sample_logits {
        wgsl: shader!("sample_logits"),
        workgroup_size: 64,
        params: SampleLogitsParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Weight of each slot, 0 for an empty one.
            slot_weights: Read<f32>,
            /// Per class: weight in the cross-entropy, adjustment of its logit there.
            class_weights: Read<[f32; 2]>,
            /// One float per slot and class, from the first ray of the part on.
            logits: ReadWrite<f32>,
            /// Per ray 12 words; only the class and the semantic loss are written.
            ray_out: ReadWrite<u32>,
        }
    }
}
