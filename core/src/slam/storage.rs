//! Storing frames: which mapped frames stay as keyframes, and which go when room is short.
use super::{
    MapKeyframe, Slam, SlamError, TrackingStatus,
    keyframes::{Observation, least_useful, observation_step},
    points::{overlap, sample_points},
    report::Tracked,
    system::VIEW_SLOT,
};
use crate::{commands::Commands, frame::Frame, pose::Pose};
use alloc::vec::Vec;
use glam::DVec3;

/// Points of a frame that decide the map's box and which keyframes overlap with it.
const SEEN_POINTS: usize = 20_000;
/// A keyframe that sees more than this share of a frame's points overlaps with it.
const MIN_OVERLAP: f64 = 0.05;

impl Slam {
    /// The keyframes kept for mapping.
    pub fn keyframes(&self) -> &[MapKeyframe] {
        &self.keyframes
    }

    /// Whether a tracked frame is mapped.
    pub(super) fn is_mapped(&self, frame: &Frame, tracked: &Tracked) -> bool {
        let due = frame.index.is_multiple_of(self.config.mapping.every as usize);
        tracked.status != TrackingStatus::Lost && (due || tracked.is_reference)
    }

    /// Whether a frame that is mapped stays as a keyframe.
    pub(super) fn becomes_keyframe(&self, frame: &Frame, tracked: &Tracked) -> bool {
        let since = self.keyframes.last().map_or(0, |k| frame.index - k.frame);
        let every = self.config.keyframes.every as usize;
        self.keyframes.is_empty() || tracked.is_reference || since >= every
    }

    /// World points that a frame sees from a pose.
    pub(super) fn seen_points(&self, frame: &Frame, world_from_camera: &Pose) -> Vec<DVec3> {
        let (camera, unit) = (self.info.camera, self.info.depth_unit_m);
        let seen = sample_points(frame, &camera, unit, SEEN_POINTS, self.config.seed);
        let world = |p: &[f32; 4]| {
            let p = DVec3::new(p[0].into(), p[1].into(), p[2].into());
            world_from_camera.transform_point(p)
        };
        seen.iter().map(world).collect()
    }

    /// Stores a frame's images: it is the newest keyframe from now on.
    pub(super) fn store(
        &mut self,
        frame: &Frame,
        world_from_camera: Pose,
    ) -> Result<(), SlamError> {
        let Some(slot) = self.take_slot() else {
            return Err(SlamError::Frame {
                frame: frame.index,
                field: "keyframes",
                found: "no storage for another frame".into(),
                expected: "a larger keyframes.budget_mib".into(),
            });
        };
        self.class_counts.add(self.info.classes.len(), frame);
        let (engine, map, _) = self.mapped()?;
        let mut r = Commands::default();
        map.frames.upload_frame(&mut r, slot, frame);
        engine.submit(&r)?;
        self.keyframes.push(MapKeyframe { frame: frame.index, slot, world_from_camera });
        self.observe(frame);
        Ok(())
    }

    /// Keeps what a frame has observed.
    fn observe(&mut self, frame: &Frame) {
        let camera = self.info.camera;
        let step = observation_step(camera.width) as usize;
        let (w, h) = (camera.width as usize, camera.height as usize);
        let depth = (0..h / step)
            .flat_map(|v| (0..w / step).map(move |u| (u, v)))
            .map(|(u, v)| frame.depth[(v * step + (step - 1) / 2) * w + u * step + (step - 1) / 2])
            .collect();
        self.observations.push(Observation { frame: frame.index, depth });
    }

    /// Forgets the newest keyframe's images.
    pub(super) fn release_newest(&mut self) {
        if let Some(k) = self.keyframes.pop() {
            self.free_slots.push(k.slot);
        }
    }

    /// Keyframes before the newest one that see some of the points.
    pub(super) fn overlapping(&self, seen: &[DVec3]) -> Vec<usize> {
        let near =
            |k: &MapKeyframe| overlap(seen, &self.info.camera, &k.world_from_camera) > MIN_OVERLAP;
        let before = self.keyframes.len().saturating_sub(1);
        (0..before).filter(|&i| near(&self.keyframes[i])).collect()
    }

    /// A slot for a frame's images, dropping the least useful keyframe when all are taken.
    pub(super) fn take_slot(&mut self) -> Option<u32> {
        if self.free_slots.is_empty() {
            let i = least_useful(&self.keyframes)?;
            let dropped = self.keyframes.remove(i);
            self.free_slots.push(dropped.slot);
        }
        debug_assert!(!self.free_slots.contains(&VIEW_SLOT));
        let slot = self.free_slots.pop()?;
        self.used_slots = self.used_slots.max(slot + 1);
        Some(slot)
    }
}
