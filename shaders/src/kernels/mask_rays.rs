//! Takes outliers out of the tracking losses.
use crate::layout::FieldParams;

interface! {
    /// Masks rays without depth and those whose depth error exceeds ten times the median.
    pub mask_rays {
        wgsl: shader!("mask_rays"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// Per ray 3 vec4: red, green, blue, depth | opacity, class (bits), color loss, depth
            /// loss | semantic loss, distance loss, depth error, mask.
            ray_out: ReadWrite<[f32; 4]>,
        }
    }
}
