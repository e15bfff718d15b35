//! Depth sampling: guided by the sensor's depth, or by the trained signed distance.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Places the samples of each ray, sorted.
    pub sample_depths {
        wgsl: shader!("sample_depths"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Geometry planes.
            planes_geometry: Read<[f32; 4]>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// Depth of each sample along its ray \[m\].
            depths: ReadWrite<f32>,
        }
    }
}
