//! Anchors follow the features matched to them (paper eqs. 11, 12).
use crate::rays::Ray;

shared_struct! {
    /// Parameters of `update_anchors`.
    pub struct UpdateAnchorsParams {
        /// Rays of the batch.
        rays: u32,
        /// Slots of anchors.
        anchors: u32,
        /// Classes.
        classes: u32,
        /// 0: moving average with `beta` (11), 1: running mean (12).
        rule: u32,
        /// Weight of a new feature.
        beta: f32,
        /// Matches that the running mean remembers at most.
        memory: f32,
        /// What importance and votes keep at each update.
        decay: f32,
        /// What the temporal variation keeps at each update.
        variation_decay: f32,
    }
}

interface! {
    /// One update of every anchor from a batch's features; its class is that of most votes.
    pub update_anchors {
        wgsl: shader!("update_anchors"),
        workgroup_size: 64,
        params: UpdateAnchorsParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: Read<[f32; 4]>,
            /// Anchors, `ANCHOR_FLOATS` floats each: vector (16) | class (bits, 255: free),
            /// matches, importance, variation | age.
            anchors: ReadWrite<[f32; 4]>,
            /// Per anchor and class: decayed number of matched rays with that label.
            votes: ReadWrite<f32>,
        }
    }
}
