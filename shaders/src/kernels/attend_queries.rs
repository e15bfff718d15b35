//! Gradients of the attention at its queries.
use crate::tokens::TokenParams;

interface! {
    /// Adds dL/dQ and dL/d(residual); keeps sum of output x gradient for `attend_keys`.
    pub attend_queries {
        wgsl: shader!("attend_queries"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Activations of the tokens, see [`crate::tokens`].
            tokens: Read<f32>,
            /// Gradients at the activations of the tokens.
            token_gradient: ReadWrite<f32>,
        }
    }
}
