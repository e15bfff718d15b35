//! Cross-attention over the tokens of an image, streamed over tiles (paper eqs. 1-4).
use crate::tokens::TokenParams;

interface! {
    /// softmax(Q K^T / 4) V, and the log-sum-exp for the backward pass.
    pub attend_tokens {
        wgsl: shader!("attend_tokens"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Activations of the tokens, see [`crate::tokens`].
            tokens: ReadWrite<f32>,
        }
    }
}
