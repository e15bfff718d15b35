//! Feature redundancy suppressor (paper III-B): the anchors, and the passes that move them.
use super::{Batch, Map, Scratch};
use crate::{
    config::{AnchorRule, SuppressorConfig},
    engine::{Engine, EngineError},
    kernels::{
        maintain_anchors::{MAINTAIN_ANCHORS, MaintainAnchorsParams},
        match_rivals::{MATCH_RIVALS, MatchRivalsParams},
        settle_anchors::{SETTLE_ANCHORS, SettleAnchorsParams},
        update_anchors::{UPDATE_ANCHORS, UpdateAnchorsParams},
    },
    layout::{ANCHOR_FLOATS, NO_DISTANCE},
    recording::{BufferId, Recording},
};
use alloc::{vec, vec::Vec};
use serde::{Deserialize, Serialize};

/// How sharply the settling of anchors attends to rays that are mistaken, or nearly so: with less, rays
/// well inside a common class wear the border to a rare one down.
const SETTLE_SLOPE: f32 = 400.0;

/// Buffers of the suppressor.
pub struct Suppressor {
    /// Anchors, [`ANCHOR_FLOATS`] each.
    pub anchors: BufferId,
    /// Votes of the matched rays' labels, one float per slot and class.
    pub votes: BufferId,
    pub(super) counts: BufferId,
    /// Since the anchors began to settle: rays of each class of the head whose labels agree, and do not.
    pub(super) support: BufferId,
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
    pub(super) fn new(
        e: &mut Engine,
        config: &SuppressorConfig,
        classes: u32,
    ) -> Result<Suppressor, EngineError> {
        let n = config.anchors as usize;
        let s = Suppressor {
            anchors: e.create_buffer("anchors", n * ANCHOR_FLOATS)?,
            votes: e.create_buffer("votes", n * classes as usize)?,
            counts: e.create_buffer("anchor counts", 4)?,
            support: e.create_buffer("class support", 2 * classes as usize)?,
            config: config.clone(),
        };
        let mut free = vec![0_u32; n * ANCHOR_FLOATS];
        for a in free.chunks_exact_mut(ANCHOR_FLOATS) {
            a[16] = 255;
        }
        let mut r = Recording::default();
        r.upload(s.anchors, 0, &free);
        e.submit(&r)?;
        Ok(s)
    }

    /// Slots of anchors.
    pub fn slots(&self) -> u32 {
        self.config.anchors
    }
}

/// Moves the anchors to the features of the last forward pass.
///
/// Records nothing without a suppressor.
pub fn record_update(r: &mut Recording, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let Some(s) = &map.suppressor else { return };
    let c = &s.config;
    r.dispatch(
        &UPDATE_ANCHORS,
        &UpdateAnchorsParams {
            rays: b.rays(),
            anchors: c.anchors,
            classes: map.classes,
            rule: u32::from(c.rule == AnchorRule::Mean),
            beta: c.beta as f32,
            memory: c.memory as f32,
            decay: c.decay as f32,
            variation_decay: 0.9,
        },
        &[scratch.rays, scratch.ray_state, s.anchors, s.votes],
        [c.anchors, 1, 1],
    );
}

/// Drops, merges and spawns anchors from the features of the last forward pass.
///
/// Records nothing without a suppressor.
pub fn record_maintenance(r: &mut Recording, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let Some(s) = &map.suppressor else { return };
    let c = &s.config;
    let square = |d: f64| (d * d) as f32;
    r.dispatch(
        &MAINTAIN_ANCHORS,
        &MaintainAnchorsParams {
            rays: b.rays(),
            anchors: c.anchors,
            classes: map.classes,
            spawns: c.spawns,
            spawn_distance: square(c.spawn_distance),
            merge_distance: square(c.merge_distance),
            stable: c.stable as f32,
            min_importance: c.min_importance as f32,
            min_age: f64::from(c.min_age) as f32,
            ..MaintainAnchorsParams::default()
        },
        &[scratch.rays, scratch.ray_state, s.anchors, s.votes, s.counts, s.support],
        [1, 1, 1],
    );
}

/// Moves the anchors so that the nearest one gives the head's class of the last forward pass's rays,
/// then gives an anchor to classes of the head that have none, if labels bear them out. Nothing else
/// changes, but that the rays count for the head's classes from then on. `begin`: anchors first take
/// the head's classes, and labels count from zero.
///
/// Records nothing without a suppressor.
pub fn record_settling(
    r: &mut Recording,
    map: &Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rate: f64,
    begin: bool,
) {
    let Some(s) = &map.suppressor else { return };
    let (anchors, classes) = (s.config.anchors, map.classes);
    let settle = |r: &mut Recording, rays| {
        r.dispatch(
            &SETTLE_ANCHORS,
            &SettleAnchorsParams {
                rays,
                anchors,
                classes,
                rate: rate as f32,
                slope: SETTLE_SLOPE,
                ..SettleAnchorsParams::default()
            },
            &[scratch.rays, scratch.ray_state, map.decoders.values, s.anchors],
            [anchors, 1, 1],
        );
    };
    if begin {
        r.upload(s.support, 0, &vec![0_u32; 2 * classes as usize]);
        settle(r, 0);
    }
    let rays = b.rays();
    r.dispatch_1d(
        &MATCH_RIVALS,
        &MatchRivalsParams { rays, anchors, classes, ..MatchRivalsParams::default() },
        &[scratch.ray_out, s.anchors, scratch.rays, scratch.ray_state, s.support],
        rays as usize,
    );
    settle(r, rays);
    r.dispatch(
        &MAINTAIN_ANCHORS,
        &MaintainAnchorsParams {
            rays,
            anchors,
            classes,
            spawns: classes,
            // None but the first of a class; none goes but for it.
            spawn_distance: 0.5 * NO_DISTANCE,
            min_age: f32::MAX,
            supported: 1,
            ..MaintainAnchorsParams::default()
        },
        &[scratch.rays, scratch.ray_state, s.anchors, s.votes, s.counts, s.support],
        [1, 1, 1],
    );
}

/// What the suppressor did so far; `None` without one.
///
/// # Errors
/// Engine failures.
pub async fn read_counts(
    engine: &mut Engine,
    map: &Map,
) -> Result<Option<AnchorCounts>, EngineError> {
    let Some(s) = &map.suppressor else { return Ok(None) };
    let c: Vec<u32> = engine.read(s.counts, 0, 4).await?;
    Ok(Some(AnchorCounts { alive: c[0], spawned: c[1], dropped: c[2], merged: c[3] }))
}
