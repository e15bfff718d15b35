//! Interval weights, composited depth, opacity and features.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Weights of a ray's intervals (NeuS), composited depth, opacity and features.
    pub composite {
        wgsl: shader!("composite"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Depth of each sample along its ray \[m\].
            depths: Read<f32>,
            /// Signed distance of each sample \[truncations\].
            distances: Read<f32>,
            /// Appearance planes.
            planes_appearance: Read<[f32; 4]>,
            /// Semantic planes.
            planes_semantic: Read<[f32; 4]>,
            /// Weight of the interval from each sample to the next; the last of a ray is 0.
            weights: ReadWrite<f32>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: ReadWrite<[f32; 4]>,
        }
    }
}
