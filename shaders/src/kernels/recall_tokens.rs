//! What the map already holds at the tokens' points.
use crate::layout::FieldParams;

interface! {
    /// The map's semantic feature at each token's point, as an input of the fusion.
    pub recall_tokens {
        wgsl: shader!("recall_tokens"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Semantic planes.
            planes_semantic: Read<[f32; 4]>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// Raw inputs of the tokens, see [`crate::tokens`].
            raw: ReadWrite<f32>,
        }
    }
}
