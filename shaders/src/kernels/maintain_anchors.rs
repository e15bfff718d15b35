//! Drops, merges and spawns anchors.
use crate::rays::Ray;

shared_struct! {
    /// Parameters of `maintain_anchors`.
    pub struct MaintainAnchorsParams {
        /// Rays of the batch.
        rays: u32,
        /// Slots of anchors, at most 256.
        anchors: u32,
        /// Classes, at most 255.
        classes: u32,
        /// Anchors spawned at most.
        spawns: u32,
        /// A feature this far from every anchor of its class (squared) may spawn one.
        spawn_distance: f32,
        /// Anchors of a class closer than this (squared) are duplicates; nor does anything spawn
        /// this close to an anchor.
        merge_distance: f32,
        /// Duplicates merge once both move less than this per update.
        stable: f32,
        /// Less important anchors are dropped.
        min_importance: f32,
        /// Updates before an anchor may be dropped or merged.
        min_age: f32,
        /// 1: only classes that labels bear out (`class_support`) get anchors.
        supported: u32,
        /// Unused.
        spare0: u32,
        /// Unused.
        spare1: u32,
    }
}

interface! {
    /// Drops unimportant anchors, merges stable duplicates, spawns anchors for features far from
    /// their class's; where all slots are taken, a class without any takes the place of the least
    /// important one that is not its class's last. Counts what it did (alive, spawned, dropped, merged).
    pub maintain_anchors {
        wgsl: shader!("maintain_anchors"),
        workgroup_size: 256,
        params: MaintainAnchorsParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: ReadWrite<[f32; 4]>,
            /// Anchors, `ANCHOR_FLOATS` floats each: vector (16) | class (bits, 255: free),
            /// matches, importance, variation | age.
            anchors: ReadWrite<[f32; 4]>,
            /// Per anchor and class: decayed number of matched rays with that label.
            votes: ReadWrite<f32>,
            /// Numbers of anchors alive, spawned, dropped, merged.
            anchor_counts: ReadWrite<u32>,
            /// Per class of the head: rays whose labels agree, and do not.
            class_support: Read<u32>,
        }
    }
}
