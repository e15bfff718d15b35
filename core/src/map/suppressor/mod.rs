//! Feature redundancy suppressor (paper III-B): the anchors.
mod passes;

pub use passes::{read_counts, record_maintenance, record_settling, record_update};

use crate::{
    commands::{Buffer, Commands},
    config::SuppressorConfig,
    engine::{Engine, EngineError},
    layout::ANCHOR_FLOATS,
};
use alloc::vec;
use serde::{Deserialize, Serialize};

/// Buffers of the suppressor.
pub struct Suppressor {
    /// Anchors, [`ANCHOR_FLOATS`] each.
    pub anchors: Buffer<[f32; 4]>,
    /// Votes of the matched rays' labels, one float per slot and class.
    pub votes: Buffer<f32>,
    pub(in crate::map) counts: Buffer<u32>,
    /// Since the anchors began to settle: rays of each class of the head whose labels agree, and do not.
    pub(in crate::map) support: Buffer<u32>,
    config: SuppressorConfig,
}

/// What the suppressor did so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AnchorCounts {
    /// Anchors in use.
    pub alive: u32,
    /// Anchors made, the first ones among them.
    pub spawned: u32,
    /// Anchors dropped as unimportant.
    pub dropped: u32,
    /// Anchors merged into a duplicate.
    pub merged: u32,
}

impl Suppressor {
    pub(in crate::map) fn new(
        e: &mut Engine,
        config: &SuppressorConfig,
        classes: u32,
    ) -> Result<Suppressor, EngineError> {
        let n = config.anchors as usize;
        let s = Suppressor {
            anchors: e.create("anchors", n * ANCHOR_FLOATS)?,
            votes: e.create("votes", n * classes as usize)?,
            counts: e.create("anchor counts", 4)?,
            support: e.create("class support", 2 * classes as usize)?,
            config: config.clone(),
        };
        let mut free = vec![0_u32; n * ANCHOR_FLOATS];
        for a in free.chunks_exact_mut(ANCHOR_FLOATS) {
            a[16] = 255;
        }
        let mut r = Commands::default();
        r.upload(s.anchors, 0, &free);
        e.submit(&r)?;
        Ok(s)
    }

    /// Slots of anchors.
    pub fn slots(&self) -> u32 {
        self.config.anchors
    }
}
