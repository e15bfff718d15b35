//! Gradients at the inputs of layers on the token grid.
use crate::tokens::{TokenLayer, TokenParams};

interface! {
    /// Adds layers' contributions to the gradients at their inputs, of which no two share any.
    pub token_layer_backward {
        wgsl: shader!("token_layer_backward"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Layers of all dispatches.
            layers: Read<TokenLayer>,
            /// Weights and biases of the layers.
            parameters: Read<f32>,
            /// Activations of the tokens, see [`crate::tokens`].
            tokens: Read<f32>,
            /// Gradients at the activations of the tokens.
            token_gradient: ReadWrite<f32>,
        }
    }
}
