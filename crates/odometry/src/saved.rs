//! The odometer's state as numbers, and the odometer again from them and the frames' images.
//!
//! Pyramids, thumbnails and corners are functions of a frame's images and of the registrations of
//! colour that came after it, so they are made again rather than kept.
use super::{
    OdometryError,
    config::OdometryConfig,
    features::Corners,
    keyframe::OdometryKeyframe,
    odometer::{Odometer, Tracked},
    pose_graph::Edge,
    pyramid::RgbdPyramid,
    registration::ColorRegistration,
    thumbnail::Thumbnail,
};
use alloc::{collections::BTreeMap, vec::Vec};
use mte_slam_types::{camera::Camera, frame::Frame, pose::Pose};
use serde::{Deserialize, Serialize};

/// A keyframe without what its frame's images tell.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct SavedKeyframe {
    id: usize,
    frame: usize,
    world_from_camera: Pose,
}

/// Everything that an odometer knows beside images.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct OdometerState {
    keyframes: Vec<SavedKeyframe>,
    next_id: usize,
    /// Frame and pose of the last frame that was not lost.
    last: Option<(usize, Pose)>,
    velocity: Pose,
    lost_streak: usize,
    tracked: Vec<Tracked>,
    poses: BTreeMap<usize, Pose>,
    edges: Vec<Edge>,
    pairs: Vec<(usize, usize, Pose)>,
    corrected: bool,
}

/// A change of registration: from this frame on (with the keyframe made of it) colours lie there.
pub type Registrations = [(usize, ColorRegistration)];

/// Returns the registration in force when a frame was at hand, then those that came after. `made` tells
/// whether the change made by the frame itself came first.
pub fn since(
    registrations: &Registrations,
    frame: usize,
    made: bool,
) -> (ColorRegistration, &Registrations) {
    let before = |at: usize| if made { at <= frame } else { at < frame };
    let n = registrations.iter().take_while(|(at, _)| before(*at)).count();
    let first = n.checked_sub(1).map_or(ColorRegistration::default(), |i| registrations[i].1);
    (first, &registrations[n..])
}

impl OdometerState {
    /// Frames whose images are needed, in ascending order.
    pub fn frames(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self.keyframes.iter().map(|k| k.frame).collect();
        all.extend(self.last.map(|(frame, _)| frame));
        all.sort_unstable();
        all.dedup();
        all
    }

    /// What is wrong with a state of `frames` frames that was read from somewhere.
    pub fn check(&self, frames: usize) -> Result<(), &'static str> {
        let known = |id: &usize| self.poses.contains_key(id);
        let ids = self.keyframes.windows(2).all(|k| k[0].id < k[1].id);
        let below = |id: usize| id < self.next_id;
        if !ids || !self.keyframes.iter().all(|k| known(&k.id)) {
            return Err("keyframes without a pose, or not in their order");
        }
        if !self.poses.keys().all(|id| below(*id)) || self.poses.len() != self.next_id {
            return Err("poses of keyframes that were never made");
        }
        let last = self.last.map(|(frame, _)| frame);
        if !self.keyframes.iter().map(|k| k.frame).chain(last).all(|f| f < frames) {
            return Err("keyframes of frames that there are none of");
        }
        if self.tracked.len() > frames || self.tracked.iter().any(|t| t.frame >= frames) {
            return Err("more frames than there are");
        }
        if self.edges.iter().any(|e| !below(e.i) || !below(e.j)) {
            return Err("edges to keyframes that were never made");
        }
        let poses = (self.keyframes.iter().map(|k| k.world_from_camera))
            .chain(self.last.map(|(_, pose)| pose))
            .chain([self.velocity])
            .chain(self.tracked.iter().map(|t| t.keyframe_from_camera))
            .chain(self.poses.values().copied())
            .chain(self.pairs.iter().map(|p| p.2));
        // The state of a lost streak is used as a number of steps.
        if self.lost_streak > frames || !{ poses }.all(|p| p.is_finite()) {
            return Err("a pose or a streak that cannot be");
        }
        Ok(())
    }
}

impl Odometer {
    /// What [`Rebuild`] makes this odometer of again.
    pub fn state(&self) -> OdometerState {
        OdometerState {
            keyframes: self
                .keyframes
                .iter()
                .map(|k| SavedKeyframe {
                    id: k.id,
                    frame: k.frame,
                    world_from_camera: k.world_from_camera,
                })
                .collect(),
            next_id: self.next_id,
            last: self.last.as_ref().map(|(pyramid, pose)| (pyramid.frame, *pose)),
            velocity: self.velocity,
            lost_streak: self.lost_streak,
            tracked: self.tracked.clone(),
            poses: self.poses.clone(),
            edges: self.edges.clone(),
            pairs: self.calibration.pairs.clone(),
            corrected: self.calibration.corrected,
        }
    }
}

/// An odometer being made again, frame by frame.
pub struct Rebuild {
    config: OdometryConfig,
    state: OdometerState,
    keyframes: BTreeMap<usize, OdometryKeyframe>,
    last: Option<RgbdPyramid>,
}

impl Rebuild {
    /// From a state that [`OdometerState::check`] has passed.
    pub fn new(config: OdometryConfig, state: OdometerState) -> Rebuild {
        Rebuild { config, state, keyframes: BTreeMap::new(), last: None }
    }

    /// Takes a frame; those that nobody needs are ignored.
    pub fn add(
        &mut self,
        frame: &Frame,
        camera: &Camera,
        depth_unit_m: f64,
        registrations: &Registrations,
    ) -> Result<(), OdometryError> {
        let is_last = self.state.last.is_some_and(|(f, _)| f == frame.index);
        let saved = self.state.keyframes.iter().filter(|k| k.frame == frame.index);
        let saved: Vec<SavedKeyframe> = saved.copied().collect();
        if !is_last && saved.is_empty() {
            return Ok(());
        }
        let mut pyramid = RgbdPyramid::new(frame, camera, depth_unit_m, &self.config.pyramid)?;
        // Each change counts, not the last one alone: going back to the identity resamples, too.
        let (first, later) = since(registrations, frame.index, false);
        pyramid.register(&first);
        for (_, registration) in later {
            pyramid.register(registration);
        }
        for k in saved {
            let keyframe = OdometryKeyframe {
                id: k.id,
                frame: k.frame,
                world_from_camera: k.world_from_camera,
                thumbnail: Thumbnail::new(&pyramid),
                corners: Corners::new(&pyramid),
                pyramid: pyramid.clone(),
            };
            self.keyframes.insert(k.id, keyframe);
        }
        if is_last {
            self.last = Some(pyramid);
        }
        Ok(())
    }

    /// Returns the odometer; `None` while frames are missing.
    pub fn finish(self, registration: ColorRegistration) -> Option<Odometer> {
        let Rebuild { config, state, keyframes, last } = self;
        if keyframes.len() != state.keyframes.len() || last.is_some() != state.last.is_some() {
            return None;
        }
        let mut odometer = Odometer::new(config);
        odometer.keyframes = keyframes.into_values().collect();
        odometer.next_id = state.next_id;
        odometer.last = last.zip(state.last.map(|(_, pose)| pose));
        odometer.velocity = state.velocity;
        odometer.lost_streak = state.lost_streak;
        odometer.tracked = state.tracked;
        odometer.poses = state.poses;
        odometer.edges = state.edges;
        odometer.calibration.registration = registration;
        odometer.calibration.pairs = state.pairs;
        odometer.calibration.corrected = state.corrected;
        Some(odometer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registrations_are_replayed_from_the_right_one_on() {
        let r = |scale| ColorRegistration { scale };
        let all = [(3, r(0.9)), (7, r(0.95))];
        assert_eq!(since(&all, 2, true), (r(1.0), &all[..]));
        assert_eq!(since(&all, 3, true), (r(0.9), &all[1..]));
        assert_eq!(since(&all, 3, false), (r(1.0), &all[..]));
        assert_eq!(since(&all, 9, false), (r(0.95), &all[2..]));
    }
}
