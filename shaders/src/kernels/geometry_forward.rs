//! Signed distance at every sample.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Plane look-up and geometry decoder at every sample.
    pub geometry_forward {
        wgsl: shader!("geometry_forward"),
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
            /// Plane features of each sample: 8 vec4.
            features: ReadWrite<[f32; 4]>,
            /// Signed distance of each sample \[truncations\].
            distances: ReadWrite<f32>,
        }
    }
}
