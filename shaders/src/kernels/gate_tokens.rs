//! Normalised gating and fusion of the three modalities (paper eqs. 7, 8).
use crate::tokens::TokenParams;

interface! {
    /// Sigmoids of the gate's convolution, normalised to sum 1; F = the gated sum of G, S^, T_a.
    pub gate_tokens {
        wgsl: shader!("gate_tokens"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Activations of the tokens, see [`crate::tokens`].
            tokens: ReadWrite<f32>,
        }
    }
}
