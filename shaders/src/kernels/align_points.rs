//! Normal equations of aligning a depth image to the field, one look-up per pixel.
use crate::layout::FieldParams;

interface! {
    /// Sums of a Gauss-Newton step on the pose (left retraction): 21 of the upper triangle, 6 of
    /// the gradient, weighted squares of both residuals, points, absolute residuals.
    pub align_points {
        wgsl: shader!("align_points"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Per slot 12 floats, `world_from_camera`: rotation row-major, translation \[m\].
            poses: Read<f32>,
            /// Points of the camera frame \[m\] and the intensity of their pixels.
            pixels: Read<[f32; 4]>,
            /// Geometry planes.
            planes_geometry: Read<[f32; 4]>,
            /// Appearance planes.
            planes_appearance: Read<[f32; 4]>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// Rows of partial sums.
            partials: ReadWrite<f32>,
        }
    }
}
