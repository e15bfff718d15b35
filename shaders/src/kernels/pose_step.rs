//! One Adam step on the pose of each window frame.

shared_struct! {
    /// Parameters of `pose_step`.
    pub struct PoseStepParams {
        /// Rays of each frame.
        rays_per_frame: u32,
        /// 1: forget moments and best pose first.
        restart: u32,
        /// Step size \[m\].
        learning_rate_translation: f32,
        /// Step size \[rad\].
        learning_rate_rotation: f32,
        /// Weight of the color loss.
        weight_color: f32,
        /// Weight of the depth loss.
        weight_depth: f32,
    }
}

interface! {
    /// Sums the rays' pose gradients, one Adam step, left retraction; keeps the best pose.
    pub pose_step {
        wgsl: shader!("pose_step"),
        workgroup_size: 64,
        params: PoseStepParams,
        bindings: {
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: Read<[f32; 4]>,
            /// Per ray 3 vec4: red, green, blue, depth | opacity, class (bits), color loss, depth
            /// loss | semantic loss, distance loss, depth error, mask.
            ray_out: Read<[f32; 4]>,
            /// Slot of each window frame; the top bit fixes its pose.
            window: Read<u32>,
            /// Per slot 12 floats, `world_from_camera`: rotation row-major, translation \[m\].
            poses: ReadWrite<f32>,
            /// Per slot 36 floats: moment1 (6), moment2 (6), best loss, best pose (12), loss of
            /// this step, gradient (6), 1 - 0.9^t, 1 - 0.999^t of t steps, 2 unused.
            pose_state: ReadWrite<f32>,
        }
    }
}
