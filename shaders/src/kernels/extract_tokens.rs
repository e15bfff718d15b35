//! Raw features of each patch of an image: geometry, colors, class histogram.
use crate::tokens::TokenParams;

interface! {
    /// Geometry encoding, patch and label histogram of each token of a stored frame.
    pub extract_tokens {
        wgsl: shader!("extract_tokens"),
        workgroup_size: 64,
        params: TokenParams,
        bindings: {
            /// Per slot 12 floats, `world_from_camera`: rotation row-major, translation \[m\].
            poses: Read<f32>,
            /// Per slot width * height words: red, green, blue, compact class.
            color_images: Read<u32>,
            /// Per slot ceil(width * height / 2) words: two depths each.
            depth_images: Read<u32>,
            /// Raw inputs of the tokens, see [`crate::tokens`].
            raw: ReadWrite<f32>,
        }
    }
}
