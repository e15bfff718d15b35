//! The passes of the suppressor over a batch of rays.
use super::{AnchorCounts, Suppressor};
use crate::{
    call::Call,
    commands::Commands,
    config::AnchorRule,
    engine::{Engine, EngineError},
    kernels::{
        maintain_anchors::{self, MaintainAnchorsParams},
        match_rivals::{self, MatchRivalsParams},
        settle_anchors::{self, SettleAnchorsParams},
        update_anchors::{self, UpdateAnchorsParams},
    },
    layout::NO_DISTANCE,
    map::{Batch, Map, Scratch},
};
use alloc::{vec, vec::Vec};

/// How sharply the settling of anchors attends to rays that are mistaken, or nearly so: with less, rays
/// well inside a common class wear the border to a rare one down.
const SETTLE_SLOPE: f32 = 400.0;

/// Moves the anchors to the features of the last forward pass.
///
/// Records nothing without a suppressor.
pub fn record_update(r: &mut Commands, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let Some(s) = &map.suppressor else { return };
    let c = &s.config;
    update_anchors::Buffers {
        rays: scratch.rays,
        ray_state: scratch.ray_state,
        anchors: s.anchors,
        votes: s.votes,
    }
    .record_workgroups(
        r,
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
        [c.anchors, 1, 1],
    );
}

/// The buffers of a maintenance.
fn maintenance(s: &Suppressor, scratch: &Scratch) -> maintain_anchors::Buffers {
    maintain_anchors::Buffers {
        rays: scratch.rays,
        ray_state: scratch.ray_state,
        anchors: s.anchors,
        votes: s.votes,
        anchor_counts: s.counts,
        class_support: s.support,
    }
}

/// Drops, merges and spawns anchors from the features of the last forward pass.
///
/// Records nothing without a suppressor.
pub fn record_maintenance(r: &mut Commands, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let Some(s) = &map.suppressor else { return };
    let c = &s.config;
    let square = |d: f64| (d * d) as f32;
    maintenance(s, scratch).record_workgroups(
        r,
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
    r: &mut Commands,
    map: &Map,
    scratch: &Scratch,
    b: &Batch<'_>,
    rate: f64,
    begin: bool,
) {
    let Some(s) = &map.suppressor else { return };
    let (anchors, classes) = (s.config.anchors, map.classes);
    let settle = |r: &mut Commands, rays| {
        settle_anchors::Buffers {
            rays: scratch.rays,
            ray_state: scratch.ray_state,
            decoders: map.decoders.values,
            anchors: s.anchors,
        }
        .record_workgroups(
            r,
            &SettleAnchorsParams {
                rays,
                anchors,
                classes,
                rate: rate as f32,
                slope: SETTLE_SLOPE,
                ..SettleAnchorsParams::default()
            },
            [anchors, 1, 1],
        );
    };
    if begin {
        r.upload(s.support, 0, &vec![0_u32; 2 * classes as usize]);
        settle(r, 0);
    }
    let rays = b.rays();
    match_rivals::Buffers {
        ray_out: scratch.ray_out,
        anchors: s.anchors,
        rays: scratch.rays,
        ray_state: scratch.ray_state,
        class_support: s.support,
    }
    .record(
        r,
        &MatchRivalsParams { rays, anchors, classes, ..MatchRivalsParams::default() },
        rays as usize,
    );
    settle(r, rays);
    maintenance(s, scratch).record_workgroups(
        r,
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
