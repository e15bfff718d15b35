//! Pixel and ray sampling.
use crate::{layout::FieldParams, rays::Ray};

interface! {
    /// Draws the pixels of a batch and makes their world rays.
    pub sample_rays {
        wgsl: shader!("sample_rays"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Per slot 12 floats, `world_from_camera`: rotation row-major, translation \[m\].
            poses: Read<f32>,
            /// Slot of each window frame; the top bit fixes its pose.
            window: Read<u32>,
            /// Per slot width * height words: red, green, blue, compact class.
            color_images: Read<u32>,
            /// Per slot ceil(width * height / 2) words: two depths each.
            depth_images: Read<u32>,
            /// How rare each class is; only the order matters.
            class_rarity: Read<f32>,
            /// Rays of the batch.
            rays: ReadWrite<Ray>,
        }
    }
}
