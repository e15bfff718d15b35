//! Gradients through the gating.
use crate::tokens::TokenParams;

interface! {
    /// From dL/dF to the gate's convolution and the three modalities.
    pub gate_backward {
        wgsl: shader!("gate_backward"),
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
