//! Semantic plane features of a ray's samples.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Features, depth and weight of every slot of a ray: all intervals, or in views the first ones
    /// that carry weight.
    pub sample_features {
        wgsl: shader!("sample_features"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Depth of each sample along its ray \[m\].
            depths: Read<f32>,
            /// Weight of the interval from each sample to the next; the last of a ray is 0.
            weights: Read<f32>,
            /// Semantic planes.
            planes_semantic: Read<[f32; 4]>,
            /// Plane features of each sample: 8 vec4.
            features: ReadWrite<[f32; 4]>,
            /// Middle of each slot's interval along the ray \[m\].
            slot_depths: ReadWrite<f32>,
            /// Weight of each slot, 0 for an empty one.
            slot_weights: ReadWrite<f32>,
        }
    }
}
