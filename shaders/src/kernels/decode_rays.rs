//! Decoders and class head on composited features; the losses of color, classes, feature and
//! compression; their gradients.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Color, semantic feature and classes of each ray; losses; gradients at the features.
    pub decode_rays {
        wgsl: shader!("decode_rays"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: ReadWrite<[f32; 4]>,
            /// Per ray 3 vec4: red, green, blue, depth | opacity, class (bits), color loss, depth
            /// loss | semantic loss, distance loss, depth error, mask.
            ray_out: ReadWrite<[f32; 4]>,
            /// Gradients at the class logits: one float per ray and class.
            logits_gradient: ReadWrite<f32>,
            /// Anchors, `ANCHOR_FLOATS` floats each: vector (16) | class (bits, 255: free),
            /// matches, importance, variation | age.
            anchors: Read<[f32; 4]>,
            /// Fused features as the targets of rays, `TARGET_FLOATS` floats per slot and token.
            targets: Read<[f32; 4]>,
            /// Per class: weight in the cross-entropy, adjustment of its logit there.
            class_weights: Read<[f32; 2]>,
        }
    }
}
