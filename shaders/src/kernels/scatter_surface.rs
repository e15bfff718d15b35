//! Adds feature gradients into the appearance and semantic planes, fixed point.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Scatter of the composited features' gradients, weighted by the intervals.
    pub scatter_surface {
        wgsl: shader!("scatter_surface"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Depth of each sample along its ray \[m\].
            depths: Read<f32>,
            /// Weight of the interval from each sample to the next; the last of a ray is 0.
            weights: Read<f32>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: Read<[f32; 4]>,
            /// Gradients of the appearance planes in fixed point.
            gradient_appearance: Atomic<i32>,
            /// Gradients of the semantic planes in fixed point.
            gradient_semantic: Atomic<i32>,
            /// Bits of what went wrong, in the first word.
            status: Atomic<u32>,
        }
    }
}
