//! From gradients at the signed distances to gradients at features and positions.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Gradients at the plane features (over the features) and at the sample positions.
    pub geometry_backward {
        wgsl: shader!("geometry_backward"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Depth of each sample along its ray \[m\].
            depths: Read<f32>,
            /// Geometry planes.
            planes_geometry: Read<[f32; 4]>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// Gradient at the signed distance of each sample.
            distance_gradient: Read<f32>,
            /// Plane features of each sample: 8 vec4.
            features: ReadWrite<[f32; 4]>,
            /// Gradient at the position of each sample.
            position_gradient: ReadWrite<[f32; 4]>,
        }
    }
}
