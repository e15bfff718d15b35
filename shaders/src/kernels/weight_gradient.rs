//! Gradients of the decoders that run once per ray.

shared_struct! {
    /// Parameters of `weight_gradient`.
    pub struct WeightGradientParams {
        /// Rays.
        rays: u32,
        /// Inputs of the layer.
        inputs: u32,
        /// Outputs of the layer.
        outputs: u32,
        /// Rays per chunk; a chunk is a row of partials.
        chunk: u32,
        /// Offset of the inputs in a ray's state \[floats\].
        input_offset: u32,
        /// Offset of the deltas in a ray's state \[floats\].
        delta_offset: u32,
        /// 1: the deltas are the logits' gradients.
        from_logits: u32,
        /// Floats per row of partials.
        row: u32,
        /// Where the weights start in a row.
        weight_offset: u32,
        /// Where the bias starts in a row.
        bias_offset: u32,
        /// Floats from one input's weights to the next one's.
        input_stride: u32,
        /// Floats from one output's weights to the next one's.
        output_stride: u32,
    }
}

interface! {
    /// dW = sum over rays of input x delta, in chunks of rays.
    pub weight_gradient {
        wgsl: shader!("weight_gradient"),
        workgroup_size: 64,
        params: WeightGradientParams,
        bindings: {
            /// As `ray_state` of other kernels, float by float.
            ray_state: Read<f32>,
            /// Gradients at the class logits: one float per ray and class.
            logits_gradient: Read<f32>,
            /// Rows of partial sums.
            partials: ReadWrite<f32>,
        }
    }
}
