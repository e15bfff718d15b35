//! Gradient of the geometry decoder.
use crate::layout::FieldParams;

interface! {
    /// Partial gradients of the geometry decoder, a row per workgroup, laid out as the decoder. Samples come in
    /// tiles of 64; every `decoder_stride`-th tile is used and scaled up.
    pub geometry_weights {
        wgsl: shader!("geometry_weights"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Plane features of each sample: 8 vec4.
            features: Read<[f32; 4]>,
            /// Gradient at the signed distance of each sample.
            distance_gradient: Read<f32>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// Rows of partial sums.
            partials: ReadWrite<[f32; 4]>,
        }
    }
}
