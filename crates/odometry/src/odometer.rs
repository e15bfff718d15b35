//! What to align each frame with, and when it is lost.
use super::{
    OdometryError,
    align::{Alignment, Reference, align_levels},
    calibration::Calibration,
    config::OdometryConfig,
    features::Corners,
    keyframe::OdometryKeyframe,
    pose_graph::{Edge, PoseGraph},
    pyramid::RgbdPyramid,
    registration::ColorRegistration,
    result::{LostReason, OdometryResult, Quality},
    thumbnail::Thumbnail,
};
use alloc::{collections::BTreeMap, vec::Vec};
use mte_slam_types::pose::Pose;
use serde::{Deserialize, Serialize};

/// Where a tracked frame is: relative to a keyframe, so that it follows corrections.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Tracked {
    pub frame: usize,
    pub keyframe: usize,
    pub keyframe_from_camera: Pose,
    pub lost: bool,
}

/// Frame-by-frame RGB-D odometry against keyframes.
#[derive(Debug)]
pub struct Odometer {
    pub(super) config: OdometryConfig,
    pub(super) keyframes: Vec<OdometryKeyframe>,
    pub(super) next_id: usize,
    pub(super) last: Option<(RgbdPyramid, Pose)>,
    /// `last_from_previous^-1` motion of the last step in the camera frame.
    pub(super) velocity: Pose,
    pub(super) lost_streak: usize,
    pub(super) tracked: Vec<Tracked>,
    /// Keyframe poses also of dropped keyframes.
    pub(super) poses: BTreeMap<usize, Pose>,
    pub(super) edges: Vec<Edge>,
    pub(super) calibration: Calibration,
}

impl Odometer {
    /// An odometer that has seen nothing.
    pub fn new(config: OdometryConfig) -> Odometer {
        Odometer {
            config,
            keyframes: Vec::new(),
            next_id: 0,
            last: None,
            velocity: Pose::IDENTITY,
            lost_streak: 0,
            tracked: Vec::new(),
            poses: BTreeMap::new(),
            edges: Vec::new(),
            calibration: Calibration::default(),
        }
    }

    /// Returns the settings.
    pub fn config(&self) -> &OdometryConfig {
        &self.config
    }

    /// Where the colour image has been found to lie on the depth image; the identity as long as
    /// nothing speaks against it.
    pub fn color_registration(&self) -> ColorRegistration {
        self.calibration.registration
    }

    /// The keyframes that are kept, oldest first.
    pub fn keyframes(&self) -> &[OdometryKeyframe] {
        &self.keyframes
    }

    /// Corrects a keyframe's pose from outside (the mapper refines it). Frames located relative to
    /// it follow. Returns whether the keyframe is known and the pose finite.
    pub fn set_keyframe_pose(&mut self, id: usize, pose: Pose) -> bool {
        if !pose.is_finite() {
            return false;
        }
        self.calibration.corrected = true;
        let Some(k) = self.keyframes.iter_mut().find(|k| k.id == id) else { return false };
        let change = pose.compose(&k.world_from_camera.inverse());
        k.world_from_camera = pose;
        self.poses.insert(id, pose);
        if self.tracked.last().is_some_and(|t| t.keyframe == id)
            && let Some((_, last)) = &mut self.last
        {
            *last = change.compose(last);
        }
        true
    }

    /// Corrects the pose of the frame tracked last (a tracker against the map refined it).
    pub fn set_last_pose(&mut self, pose: Pose) {
        if !pose.is_finite() {
            return;
        }
        self.calibration.corrected = true;
        if let Some((_, last)) = &mut self.last {
            let before = *last;
            // The step before it grows by the correction.
            self.velocity = self.velocity.compose(&before.inverse().compose(&pose));
            *last = pose;
        }
        if let Some(t) = self.tracked.last_mut() {
            let frame = t.frame;
            if let Some(k) = self.keyframes.iter_mut().find(|k| k.frame == frame) {
                k.world_from_camera = pose;
                self.poses.insert(k.id, pose);
            } else if let Some(k) = self.poses.get(&t.keyframe) {
                t.keyframe_from_camera = k.inverse().compose(&pose);
            }
        }
    }

    /// Corrects the pose of any frame so far (the mapper refined it). The pose of a keyframe's frame
    /// moves the keyframe, and with it the frames located relative to it. Returns whether the
    /// frame is known and the pose finite.
    pub fn set_frame_pose(&mut self, frame: usize, pose: Pose) -> bool {
        if let Some(id) = self.keyframes.iter().find(|k| k.frame == frame).map(|k| k.id) {
            return self.set_keyframe_pose(id, pose);
        }
        if self.tracked.last().is_some_and(|t| t.frame == frame) {
            self.set_last_pose(pose);
            return pose.is_finite();
        }
        let Some(t) = self.tracked.iter_mut().find(|t| t.frame == frame) else { return false };
        let Some(k) = self.poses.get(&t.keyframe).filter(|_| pose.is_finite()) else {
            return false;
        };
        t.keyframe_from_camera = k.inverse().compose(&pose);
        true
    }

    /// Constant-velocity prediction of the next frame's pose; identity before the first frame.
    pub fn predict(&self) -> Pose {
        match &self.last {
            Some((_, pose)) => pose.compose(&self.velocity).orthonormalised(),
            None => Pose::IDENTITY,
        }
    }

    /// (`Frame::index`, pose, lost) of every frame so far, with all corrections to keyframes.
    pub fn trajectory(&self) -> Vec<(usize, Pose, bool)> {
        self.tracked
            .iter()
            .map(|t| {
                let k = self.poses.get(&t.keyframe).copied().unwrap_or_default();
                (t.frame, k.compose(&t.keyframe_from_camera), t.lost)
            })
            .collect()
    }

    /// Locates a frame. `prediction`: where it is expected (`None`: constant velocity). The first
    /// frame gets the prediction as its pose.
    ///
    /// # Errors
    /// [`OdometryError::BadPose`] for a prediction that is not finite; [`OdometryError::NoDepth`]
    /// for a first frame without depth. A later one is reported as lost.
    pub fn track(
        &mut self,
        mut current: RgbdPyramid,
        prediction: Option<Pose>,
    ) -> Result<OdometryResult, OdometryError> {
        current.register(&self.calibration.registration);
        let predicted = prediction.unwrap_or_else(|| self.predict());
        if !predicted.is_finite() {
            return Err(OdometryError::BadPose { frame: current.frame });
        }
        let Some((last, last_pose)) = self.last.take() else {
            current.check()?;
            let id = self.add_keyframe(&current, predicted, &[]);
            self.note(&current, predicted, id, false);
            self.last = Some((current, predicted));
            return Ok(OdometryResult {
                world_from_camera: predicted,
                quality: Quality { overlap: 1.0, inlier_ratio: 1.0, ..Quality::default() },
                lost: false,
                reason: None,
                recovered: false,
                keyframe: Some(id),
            });
        };
        let mut recovered = false;
        let mut found = None;
        let mut reason = LostReason::NoDepth;
        if current.check().is_ok() {
            let mut best = self.attempt(Some((&last, &last_pose)), &current, &predicted)?;
            let verdict = self.judge(&best.0, &last_pose);
            let step = last_pose.inverse().compose(&best.0.pose);
            let motion =
                step.translation.length() / current.median_depth_m.max(0.2) + step.angle_rad();
            if verdict.is_err()
                || self.lost_streak > 0
                || motion > self.config.wide_motion
                || best.0.inlier_ratio < self.config.doubtful_inlier_ratio
            {
                recovered = verdict.is_err() || self.lost_streak > 0;
                for start in self.search(&last, &last_pose, &current, &predicted, recovered)? {
                    let other = self.attempt(None, &current, &start)?;
                    if other.0.score < best.0.score {
                        best = other;
                    }
                }
            }
            match self.judge(&best.0, &last_pose) {
                Ok(()) => found = Some(best),
                Err(why) => reason = why,
            }
        }
        let Some((fit, used)) = found else {
            self.lost_streak += 1;
            self.velocity = Pose::IDENTITY;
            let id = self.nearest_keyframe(&last_pose);
            self.note(&current, predicted, id, true);
            self.last = Some((last, last_pose));
            return Ok(OdometryResult {
                world_from_camera: predicted,
                quality: Quality::default(),
                lost: true,
                reason: Some(reason),
                recovered: false,
                keyframe: None,
            });
        };
        let mut pose = fit.pose;
        self.velocity =
            if self.lost_streak == 0 { last_pose.inverse().compose(&pose) } else { Pose::IDENTITY };
        self.lost_streak = 0;
        let keyframe = if self.wants_keyframe(&fit, &pose, &current) {
            let id = self.add_keyframe(&current, pose, &used);
            self.calibration.update(&mut self.keyframes, &mut self.poses, &self.config);
            current.register(&self.calibration.registration);
            pose = self.poses[&id];
            Some(id)
        } else {
            None
        };
        let id = keyframe.or(used.first().copied()).unwrap_or(0);
        self.note(&current, pose, id, false);
        let quality = Quality {
            inliers: fit.inliers,
            inlier_ratio: fit.inlier_ratio,
            overlap: fit.overlap,
            geometric_rmse_m: fit.geometric_rmse_m,
            photometric_rmse: fit.photometric_rmse,
            conditioning: fit.conditioning(),
            unconstrained: fit.unconstrained,
            information: fit.information,
            references: used.len(),
        };
        self.last = Some((current, pose));
        Ok(OdometryResult {
            world_from_camera: pose,
            quality,
            lost: false,
            reason: None,
            recovered,
            keyframe,
        })
    }

    fn note(&mut self, current: &RgbdPyramid, pose: Pose, keyframe: usize, lost: bool) {
        let k = self.poses.get(&keyframe).copied().unwrap_or_default();
        self.tracked.push(Tracked {
            frame: current.frame,
            keyframe,
            keyframe_from_camera: k.inverse().compose(&pose),
            lost,
        });
    }

    /// Coarse levels against `near` (the last frame as a rule), fine levels against keyframes.
    /// Returns the alignment and the identifiers of the keyframes used, best first.
    fn attempt(
        &self,
        near: Option<(&RgbdPyramid, &Pose)>,
        current: &RgbdPyramid,
        start: &Pose,
    ) -> Result<(Alignment, Vec<usize>), OdometryError> {
        let near_reference = near.map(|(pyramid, pose)| Reference {
            pyramid,
            world_from_camera: *pose,
            weight: 1.0,
        });
        let align = &self.config.align;
        let coarse = match near_reference {
            Some(r) => align_levels(&[r], current, start, align, usize::MAX, 1)?.pose,
            None => *start,
        };
        let chosen = self.choose(current, &coarse, self.config.references.max(1) as usize);
        let mut references: Vec<Reference<'_>> = chosen
            .iter()
            .map(|&k| Reference {
                pyramid: &self.keyframes[k].pyramid,
                world_from_camera: self.keyframes[k].world_from_camera,
                weight: 1.0,
            })
            .collect();
        if self.config.last_frame || references.is_empty() {
            references.extend(near_reference);
        }
        if references.is_empty() {
            // Nothing overlaps with a start that matched corners gave: take what there is.
            references.extend(self.keyframes.last().map(|k| Reference {
                pyramid: &k.pyramid,
                world_from_camera: k.world_from_camera,
                weight: 1.0,
            }));
        }
        let fit =
            align_levels(&references, current, &coarse, align, 1 + usize::from(near.is_none()), 0)?;
        Ok((fit, chosen.iter().map(|&k| self.keyframes[k].id).collect()))
    }

    fn nearest_keyframe(&self, pose: &Pose) -> usize {
        self.keyframes
            .iter()
            .min_by(|a, b| {
                let d = |k: &OdometryKeyframe| {
                    (k.world_from_camera.translation - pose.translation).length()
                };
                d(a).total_cmp(&d(b))
            })
            .map_or(0, |k| k.id)
    }

    fn judge(&self, fit: &Alignment, last_pose: &Pose) -> Result<(), LostReason> {
        let c = &self.config;
        if !fit.pose.is_finite()
            || fit.inlier_ratio < c.min_inlier_ratio
            || fit.overlap < c.min_overlap
        {
            return Err(LostReason::FewInliers);
        }
        let step = last_pose.inverse().compose(&fit.pose);
        let patience = (1 + self.lost_streak) as f64;
        if step.translation.length() > c.max_step_m * patience
            || step.angle_rad() > c.max_step_rad * patience
        {
            return Err(LostReason::Jump);
        }
        Ok(())
    }

    fn wants_keyframe(&self, fit: &Alignment, pose: &Pose, current: &RgbdPyramid) -> bool {
        let depth = current.median_depth_m().max(0.2);
        let nearest = self
            .keyframes
            .iter()
            .map(|k| {
                let d = k.world_from_camera.inverse().compose(pose);
                d.translation.length() / depth + d.angle_rad()
            })
            .fold(f64::INFINITY, f64::min);
        fit.overlap < self.config.keyframe_overlap || nearest > self.config.keyframe_motion
    }

    fn add_keyframe(&mut self, current: &RgbdPyramid, pose: Pose, _used: &[usize]) -> usize {
        let id = self.next_id;
        self.next_id += 1;
        self.keyframes.push(OdometryKeyframe {
            id,
            frame: current.frame,
            world_from_camera: pose,
            pyramid: current.clone(),
            thumbnail: Thumbnail::new(current),
            corners: Corners::new(current),
        });
        self.poses.insert(id, pose);
        if self.config.pose_graph {
            self.link_newest();
        }
        if self.keyframes.len() > self.config.max_keyframes.max(2) as usize {
            self.drop_keyframe();
        }
        id
    }

    /// Drops the keyframe that its neighbours in time can best do without.
    fn drop_keyframe(&mut self) {
        let n = self.keyframes.len();
        let spread = |i: usize| {
            let (a, b) = (&self.keyframes[i - 1], &self.keyframes[i + 1]);
            let d = a.world_from_camera.inverse().compose(&b.world_from_camera);
            d.translation.length() + d.angle_rad()
        };
        let victim = (1..n - 1).min_by(|&i, &j| spread(i).total_cmp(&spread(j))).unwrap_or(0);
        self.keyframes.remove(victim);
    }

    /// Aligns the newest keyframe with the others it overlaps and spreads what that says over all.
    fn link_newest(&mut self) {
        let Some((newest, _)) = self.keyframes.split_last() else { return };
        let links = self.choose_links(newest);
        for i in links {
            let other = &self.keyframes[i];
            let start = other.world_from_camera.inverse().compose(&newest.world_from_camera);
            let reference = Reference {
                pyramid: &other.pyramid,
                world_from_camera: Pose::IDENTITY,
                weight: 1.0,
            };
            let Ok(fit) =
                align_levels(&[reference], &newest.pyramid, &start, &self.config.align, 2, 0)
            else {
                continue;
            };
            if fit.inlier_ratio > self.config.min_inlier_ratio && fit.unconstrained == 0 {
                self.edges.push(Edge {
                    i: other.id,
                    j: newest.id,
                    i_from_j: fit.pose,
                    information: fit.information,
                });
            }
        }
        if self.keyframes.len() < 3 {
            return;
        }
        let ids: Vec<usize> = self.poses.keys().copied().collect();
        let mut graph = PoseGraph {
            poses: ids.iter().map(|id| self.poses[id]).collect(),
            edges: self.edges.clone(),
        };
        graph.optimise(1, 4, 4.0);
        for (id, pose) in ids.into_iter().zip(graph.poses) {
            self.poses.insert(id, pose);
        }
        for k in &mut self.keyframes {
            k.world_from_camera = self.poses[&k.id];
        }
    }

    fn choose_links(&self, newest: &OdometryKeyframe) -> Vec<usize> {
        let mut shares: Vec<(f64, usize)> = self
            .keyframes
            .iter()
            .enumerate()
            .filter(|(_, k)| k.id != newest.id)
            .map(|(i, k)| {
                let share = k.pyramid.visible_share(
                    &k.world_from_camera,
                    &newest.pyramid,
                    &newest.world_from_camera,
                );
                (share, i)
            })
            .filter(|&(share, _)| share > 0.3)
            .collect();
        shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        shares.truncate(self.config.graph_links as usize);
        shares.into_iter().map(|(_, i)| i).collect()
    }
}
