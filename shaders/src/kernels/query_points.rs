//! The field at single points.
use crate::layout::FieldParams;

interface! {
    /// Signed distance \[truncations\] at points; with `FLAG_MAP` color and class too, with
    /// `FLAG_ANCHORS` the class of the nearest anchor.
    pub query_points {
        wgsl: shader!("query_points"),
        workgroup_size: 64,
        params: FieldParams,
        bindings: {
            /// World points \[m\]; the fourth float is not used.
            points: Read<[f32; 4]>,
            /// Geometry planes.
            planes_geometry: Read<[f32; 4]>,
            /// Appearance planes.
            planes_appearance: Read<[f32; 4]>,
            /// Semantic planes.
            planes_semantic: Read<[f32; 4]>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// Anchors, `ANCHOR_FLOATS` floats each: vector (16) | class (bits, 255: free),
            /// matches, importance, variation | age.
            anchors: Read<[f32; 4]>,
            /// Distance \[truncations\]; with `FLAG_MAP` 8 floats per point: distance, class
            /// (bits), 0, 0 | red, green, blue, 0.
            values: ReadWrite<f32>,
        }
    }
}
