//! What trains the fusion: classes and color read from F. F is also the rays' target.
use crate::tokens::TokenParams;

interface! {
    /// Class-balanced cross-entropy and color loss of F, their gradients, and the rays' targets.
    pub token_loss {
        wgsl: shader!("token_loss"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Weights and biases of the layers.
            parameters: Read<f32>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<f32>,
            /// Weight of each class in the cross-entropy.
            class_weights: Read<f32>,
            /// Raw inputs of the tokens, see [`crate::tokens`].
            raw: Read<f32>,
            /// Activations of the tokens, see [`crate::tokens`].
            tokens: ReadWrite<f32>,
            /// Gradients at the activations of the tokens.
            token_gradient: ReadWrite<f32>,
            /// Fused features as the targets of rays, `TARGET_FLOATS` floats per slot and token.
            targets: ReadWrite<[f32; 4]>,
        }
    }
}
