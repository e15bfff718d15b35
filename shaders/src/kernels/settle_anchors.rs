//! Anchors settle where the nearest one gives the head's class.
use crate::rays::Ray;

shared_struct! {
    /// Parameters of `settle_anchors`.
    pub struct SettleAnchorsParams {
        /// Rays of the batch; 0: the anchors stay where they are and take the head's classes.
        rays: u32,
        /// Slots of anchors.
        anchors: u32,
        /// Classes.
        classes: u32,
        /// Share of the way to the weighted mean of what pulls and pushes, 0..1.
        rate: f32,
        /// How sharply rays count that are mistaken, or nearly so.
        slope: f32,
        /// Unused.
        spare0: u32,
        /// Unused.
        spare1: u32,
        /// Unused.
        spare2: u32,
    }
}

interface! {
    /// A step of generalised learning vector quantisation (Sato and Yamada, 1996) with the head as
    /// the teacher: with d the squared distance of a ray's feature to the nearest anchor of its class
    /// and e to the nearest of another (`match_rivals`), the former comes closer by s e / (d + e), the
    /// latter goes by s d / (d + e), where s is the logistic function of slope (d - e) / (d + e).
    /// After that an anchor's class is the head's.
    pub settle_anchors {
        wgsl: shader!("settle_anchors"),
        workgroup_size: 64,
        params: SettleAnchorsParams,
        bindings: {
            /// Rays of the batch.
            rays: Read<Ray>,
            /// What a ray keeps between the passes, see the `STATE_*` offsets of [`crate::layout`].
            ray_state: Read<[f32; 4]>,
            /// All decoders, see [`crate::decoders`].
            decoders: Read<[f32; 4]>,
            /// Anchors, `ANCHOR_FLOATS` floats each: vector (16) | class (bits, 255: free),
            /// matches, importance, variation | age.
            anchors: ReadWrite<[f32; 4]>,
        }
    }
}
