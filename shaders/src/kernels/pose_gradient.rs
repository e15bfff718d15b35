//! Sums the gradients at a ray's sample positions into its pose gradient.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Pose gradient of each ray: translation, and rotation about the camera's centre.
    pub pose_gradient {
        wgsl: shader!("pose_gradient"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Depth of each sample along its ray \[m\].
            depths: Read<f32>,
            /// Gradient at the position of each sample.
            position_gradient: Read<[f32; 4]>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: ReadWrite<[f32; 4]>,
        }
    }
}
