//! When the odometer registers colour to depth, and what follows from a new registration.
use super::{
    align::{Reference, align_levels},
    config::{AlignConfig, OdometryConfig},
    features::Corners,
    keyframe::OdometryKeyframe,
    registration::ColorRegistration,
    registration_search::{Pair, estimate},
    thumbnail::Thumbnail,
};
use alloc::{collections::BTreeMap, vec::Vec};
use mte_slam_types::pose::Pose;

/// Pairs needed before a registration is estimated at all.
const FEWEST_PAIRS: usize = 3;
/// A registration that moves no pixel further than this is left as it is \[pixels\].
const TOLERANCE: f64 = 0.5;
/// Geometry must constrain every direction this well (smallest over largest eigenvalue).
const CONDITIONING: f64 = 1e-3;

/// What is known about the cameras so far.
#[derive(Debug, Default)]
pub(super) struct Calibration {
    /// In use.
    pub registration: ColorRegistration,
    /// Keyframes (older, newer) and the pose between them by depth alone.
    pub pairs: Vec<(usize, usize, Pose)>,
    /// Whether somebody outside corrects poses; then they are not ours to realign.
    pub corrected: bool,
}

impl Calibration {
    /// Pairs the newest keyframe with those before and estimates the registration again. A new one
    /// is applied to the keyframes, whose poses (also in `poses`, by identifier) are then aligned
    /// anew.
    pub fn update(
        &mut self,
        keyframes: &mut [OdometryKeyframe],
        poses: &mut BTreeMap<usize, Pose>,
        config: &OdometryConfig,
    ) {
        if self.pairs.len() >= config.registration_pairs as usize {
            return;
        }
        let Some((newer, others)) = keyframes.split_last() else { return };
        let geometric = AlignConfig { photometric_weight: 0.0, ..config.align.clone() };
        // Two before: the further the camera has moved, the clearer the image slides.
        for older in others.iter().rev().take(2) {
            let reference = Reference {
                pyramid: &older.pyramid,
                world_from_camera: Pose::IDENTITY,
                weight: 1.0,
            };
            let start = older.world_from_camera.inverse().compose(&newer.world_from_camera);
            match align_levels(&[reference], &newer.pyramid, &start, &geometric, 1, 0) {
                Ok(fit)
                    if fit.inlier_ratio > config.min_inlier_ratio
                        && fit.conditioning() > CONDITIONING =>
                {
                    self.pairs.push((older.id, newer.id, fit.pose));
                }
                _ => {}
            }
        }
        if self.pairs.len() < FEWEST_PAIRS {
            return;
        }
        let find = |id: usize| keyframes.iter().find(|k| k.id == id).map(|k| &k.pyramid);
        let pairs: Vec<Pair<'_>> = self
            .pairs
            .iter()
            .filter_map(|&(a, b, reference_from_current)| {
                Some(Pair { reference: find(a)?, current: find(b)?, reference_from_current })
            })
            .collect();
        let registration = estimate(&pairs);
        let level = &newer.pyramid.levels[0];
        let radius = 0.5 * level.width.max(level.height) as f64;
        if registration.distance(&self.registration, radius) < TOLERANCE {
            return;
        }
        self.registration = registration;
        for k in keyframes.iter_mut() {
            k.pyramid.register(&registration);
            k.thumbnail = Thumbnail::new(&k.pyramid);
            k.corners = Corners::new(&k.pyramid);
        }
        if !self.corrected {
            realign(keyframes, poses, config);
        }
    }
}

/// Aligns the keyframes so far anew, each with older ones; frames between follow.
fn realign(
    keyframes: &mut [OdometryKeyframe],
    poses: &mut BTreeMap<usize, Pose>,
    config: &OdometryConfig,
) {
    for i in 1..keyframes.len() {
        let (older, rest) = keyframes.split_at(i);
        let newest = &rest[0];
        let mut shares: Vec<(f64, usize)> = older
            .iter()
            .enumerate()
            .map(|(j, k)| {
                let share = k.pyramid.visible_share(
                    &k.world_from_camera,
                    &newest.pyramid,
                    &newest.world_from_camera,
                );
                (share, j)
            })
            .filter(|&(share, _)| share > 0.2)
            .collect();
        shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        shares.truncate(config.references.max(1) as usize);
        let references: Vec<Reference<'_>> = shares
            .iter()
            .map(|&(_, j)| Reference {
                pyramid: &older[j].pyramid,
                world_from_camera: older[j].world_from_camera,
                weight: 1.0,
            })
            .collect();
        let Ok(fit) = align_levels(
            &references,
            &newest.pyramid,
            &newest.world_from_camera,
            &config.align,
            1,
            0,
        ) else {
            continue;
        };
        let (id, pose) = (newest.id, fit.pose);
        keyframes[i].world_from_camera = pose;
        poses.insert(id, pose);
    }
}
