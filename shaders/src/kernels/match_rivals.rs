//! The nearest anchors of a ray's class and of another.
use crate::rays::Ray;

shared_struct! {
    /// Parameters of `match_rivals`.
    pub struct MatchRivalsParams {
        /// Rays of the batch.
        rays: u32,
        /// Slots of anchors.
        anchors: u32,
        /// Classes.
        classes: u32,
        /// Unused.
        spare0: u32,
    }
}

interface! {
    /// For every decoded ray the nearest anchors of the class that the head gives it and of any
    /// other: at `STATE_ANCHOR` their indices (bits, `NO_ANCHOR` without one) and squared
    /// distances. The ray's label becomes the head's class, so that `maintain_anchors` finds
    /// classes of the head that have no anchor, and is counted in `class_support`: for each class of
    /// the head the rays whose labels agree and those whose labels do not.
    pub match_rivals {
        wgsl: shader!("match_rivals"),
        workgroup_size: 64,
        params: MatchRivalsParams,
        bindings: {
            /// Per ray 3 vec4: red, green, blue, depth | opacity, class (bits), color loss, depth
            /// loss | semantic loss, distance loss, depth error, mask.
            ray_out: Read<[f32; 4]>,
            /// Anchors, `ANCHOR_FLOATS` floats each: vector (16) | class (bits, 255: free),
            /// matches, importance, variation | age.
            anchors: Read<[f32; 4]>,
            /// Rays of the batch.
            rays: ReadWrite<Ray>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: ReadWrite<[f32; 4]>,
            /// Per class of the head: rays whose labels agree, and do not.
            class_support: Atomic<u32>,
        }
    }
}
