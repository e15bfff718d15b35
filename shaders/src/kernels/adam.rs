//! Sparse Adam: one step on the parameters whose gradient is not zero.

shared_struct! {
    /// Parameters of `adam`.
    pub struct AdamParams {
        /// First parameter to update, an index into all buffers but `status`.
        offset: u32,
        /// Number of parameters to update from `offset` on.
        count: u32,
        /// 1: `gradient` holds fixed-point i32; 0: f32.
        fixed_point: u32,
        /// Fixed-point gradients beyond this are skipped and set `STATUS_SATURATED`.
        gradient_limit: i32,
        /// The gradient is the stored value times this.
        gradient_scale: f32,
        /// Step size.
        learning_rate: f32,
        /// Decay of the first moment.
        beta1: f32,
        /// Decay of the second moment.
        beta2: f32,
        /// Added to the root of the second moment.
        epsilon: f32,
        /// 1 / (1 - beta1^t).
        correction1: f32,
        /// 1 / (1 - beta2^t).
        correction2: f32,
    }
}

interface! {
    /// One Adam step. As in Instant-NGP, parameters with zero gradient are left alone together
    /// with their moments; after use the gradient is set to 0.
    pub adam {
        wgsl: shader!("adam"),
        workgroup_size: 256,
        params: AdamParams,
        bindings: {
            /// Parameters.
            parameters: ReadWrite<f32>,
            /// Gradients: fixed-point i32 or f32.
            gradient: ReadWrite<u32>,
            /// First moments.
            moment1: ReadWrite<f32>,
            /// Second moments.
            moment2: ReadWrite<f32>,
            /// Bits of what went wrong, in the first word.
            status: Atomic<u32>,
        }
    }
}
