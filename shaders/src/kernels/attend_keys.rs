//! Gradients of the attention at its keys and values.
use crate::tokens::TokenParams;

interface! {
    /// Adds dL/dK and dL/dV. After `attend_queries`.
    pub attend_keys {
        wgsl: shader!("attend_keys"),
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
