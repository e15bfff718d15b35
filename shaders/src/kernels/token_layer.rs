//! Layers on the token grid: linear, 3x3 or depthwise convolution.
use crate::tokens::{TokenLayer, TokenParams};

interface! {
    /// Layers whose inputs and outputs lie side by side in a token's row; none reads what another
    /// one of the dispatch writes.
    pub token_layer {
        wgsl: shader!("token_layer"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Layers of all dispatches.
            layers: Read<TokenLayer>,
            /// Weights and biases of the layers.
            parameters: Read<f32>,
            /// Raw inputs of the tokens, see [`crate::tokens`].
            raw: Read<f32>,
            /// Activations of the tokens, see [`crate::tokens`].
            tokens: ReadWrite<f32>,
        }
    }
}
