//! Where a frame may be: keyframes that see or look like what it shows, and starts for its alignment when the
//! prediction leads nowhere.
use super::{
    OdometryError,
    align::{Reference, align_levels},
    features::Corners,
    odometer::Odometer,
    pyramid::RgbdPyramid,
    thumbnail::Thumbnail,
};
use alloc::vec::Vec;
use glam::{DMat3, DVec3};
use mte_slam_types::pose::Pose;

impl Odometer {
    /// Positions of the keyframes that see most of what the frame sees, best first.
    pub(super) fn choose(&self, current: &RgbdPyramid, pose: &Pose, most: usize) -> Vec<usize> {
        let mut shares: Vec<(f64, usize)> = self
            .keyframes
            .iter()
            .enumerate()
            .map(|(i, k)| (k.pyramid.visible_share(&k.world_from_camera, current, pose), i))
            .filter(|&(share, _)| share > 0.2)
            .collect();
        // Equal shares: the younger one.
        shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        shares.truncate(most);
        shares.into_iter().map(|(_, i)| i).collect()
    }

    /// Poses from matched corners with the last frame and with the likeliest keyframes.
    fn matched_starts(
        &self,
        last: &RgbdPyramid,
        last_pose: &Pose,
        current: &RgbdPyramid,
        lost: bool,
    ) -> Vec<Pose> {
        let features = Corners::new(current);
        let mut out = Vec::new();
        if let Some(m) = Corners::new(last).locate(&features) {
            out.push((m.inliers, last_pose.compose(&m.reference_from_current)));
        }
        let nearby = if lost { self.alike(current, 6) } else { self.choose(current, last_pose, 2) };
        for i in nearby {
            let k = &self.keyframes[i];
            if let Some(m) = k.corners.locate(&features) {
                out.push((m.inliers, k.world_from_camera.compose(&m.reference_from_current)));
            }
        }
        out.sort_by_key(|m| core::cmp::Reverse(m.0));
        out.truncate(2);
        out.into_iter().map(|(_, pose)| pose).collect()
    }

    /// Returns the most promising of many starts, after coarse alignment: matched corners, standing still,
    /// turning, moving around the scene's centre, and the keyframes that look alike when lost.
    pub(super) fn search(
        &self,
        last: &RgbdPyramid,
        last_pose: &Pose,
        current: &RgbdPyramid,
        predicted: &Pose,
        lost: bool,
    ) -> Result<Vec<Pose>, OdometryError> {
        let mut starts: Vec<(Pose, usize, &RgbdPyramid, Pose)> = Vec::new();
        for pose in self.matched_starts(last, last_pose, current, lost) {
            starts.push((pose, 2, last, *last_pose));
        }
        starts.push((*predicted, usize::MAX, last, *last_pose));
        starts.push((*last_pose, usize::MAX, last, *last_pose));
        let depth = last.median_depth_m().max(0.2);
        let centre = Pose { rotation: DMat3::IDENTITY, translation: DVec3::new(0.0, 0.0, depth) };
        for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            for angle in [0.12, 0.24] {
                let turn = Pose::from_twist(&[0.0, 0.0, 0.0, x * angle, y * angle, 0.0]);
                let orbit = centre.compose(&turn).compose(&centre.inverse());
                starts.push((last_pose.compose(&orbit), usize::MAX, last, *last_pose));
                if lost {
                    starts.push((last_pose.compose(&turn), usize::MAX, last, *last_pose));
                }
            }
        }
        if lost {
            for i in self.alike(current, 6) {
                let k = &self.keyframes[i];
                starts.push((k.world_from_camera, usize::MAX, &k.pyramid, k.world_from_camera));
            }
        }
        let mut found: Vec<(f64, Pose)> = Vec::new();
        for (start, coarsest, pyramid, world_from_camera) in starts {
            let reference = Reference { pyramid, world_from_camera, weight: 1.0 };
            let fit = align_levels(&[reference], current, &start, &self.config.align, coarsest, 2)?;
            let new = found.iter().all(|(_, other)| {
                let d = other.inverse().compose(&fit.pose);
                d.translation.length() / depth + d.angle_rad() > 0.01
            });
            if new {
                found.push((fit.score, fit.pose));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(3);
        Ok(found.into_iter().map(|(_, pose)| pose).collect())
    }

    /// Positions of the keyframes whose thumbnails resemble the frame's most.
    fn alike(&self, current: &RgbdPyramid, most: usize) -> Vec<usize> {
        let thumbnail = Thumbnail::new(current);
        let mut alike: Vec<(f32, usize)> = self
            .keyframes
            .iter()
            .enumerate()
            .map(|(i, k)| (k.thumbnail.similarity(&thumbnail), i))
            .collect();
        alike.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        alike.truncate(most);
        alike.into_iter().map(|(_, i)| i).collect()
    }
}
