//! Gradients at the signed distances: through the interval weights, and the distance losses.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Gradients at the signed distances of each ray, and the distance loss.
    pub composite_backward {
        wgsl: shader!("composite_backward"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// Depth of each sample along its ray \[m\].
            depths: Read<f32>,
            /// Signed distance of each sample \[truncations\].
            distances: Read<f32>,
            /// Weight of the interval from each sample to the next; the last of a ray is 0.
            weights: Read<f32>,
            /// Appearance planes.
            planes_appearance: Read<[f32; 4]>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: ReadWrite<[f32; 4]>,
            /// Per ray 3 vec4: red, green, blue, depth | opacity, class (bits), color loss, depth
            /// loss | semantic loss, distance loss, depth error, mask.
            ray_out: ReadWrite<[f32; 4]>,
            /// Gradient at the signed distance of each sample.
            distance_gradient: ReadWrite<f32>,
        }
    }
}
