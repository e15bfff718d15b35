//! Adds feature gradients into the geometry planes, fixed point.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Scatter of the geometry features' gradients; samples of a ray in one cell are summed first.
    pub scatter_geometry {
        wgsl: shader!("scatter_geometry"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Depth of each sample along its ray \[m\].
            depths: Read<f32>,
            /// Gradient at the signed distance of each sample.
            distance_gradient: Read<f32>,
            /// Plane features of each sample: 8 vec4.
            features: Read<[f32; 4]>,
            /// Gradients of the planes in fixed point.
            gradient: Atomic<i32>,
            /// Bits of what went wrong, in the first word.
            status: Atomic<u32>,
        }
    }
}
