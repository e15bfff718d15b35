//! Gradients of the weights of layers on the token grid.
use crate::tokens::{TokenLayer, TokenParams};

interface! {
    /// dW = sum over tokens of input x delta, in chunks of tokens.
    pub token_weights {
        wgsl: shader!("token_weights"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Layers of all dispatches.
            layers: Read<TokenLayer>,
            /// Raw inputs of the tokens, see [`crate::tokens`].
            raw: Read<f32>,
            /// Activations of the tokens, see [`crate::tokens`].
            tokens: Read<f32>,
            /// Gradients at the activations of the tokens.
            token_gradient: ReadWrite<f32>,
            /// Rows of partial sums.
            partials: ReadWrite<f32>,
        }
    }
}
