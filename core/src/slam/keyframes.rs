//! Keyframes and observations: what is kept of mapped frames.
use crate::pose::Pose;
use alloc::vec::Vec;

/// Depth images kept for culling are at most this wide.
const OBSERVATION_WIDTH: u32 = 160;

/// A frame that the map is trained with: its images are stored.
#[derive(Clone, Debug)]
pub struct MapKeyframe {
    /// `Frame::index`.
    pub frame: usize,
    /// The map's slot that holds its images.
    pub slot: u32,
    /// Its present pose.
    pub world_from_camera: Pose,
}

/// The depth image of a mapped frame at reduced size: what was observed, for culling meshes.
#[derive(Clone, Debug)]
pub(super) struct Observation {
    pub frame: usize,
    pub depth: Vec<u16>,
}

/// By how much the kept depth images are smaller.
pub(super) fn observation_step(width: u32) -> u32 {
    width.div_ceil(OBSERVATION_WIDTH).max(1)
}

/// Index of the keyframe that adds least: the one closest to another (metres plus radians), never
/// the first nor the last two. `None` with fewer than four.
pub(super) fn least_useful(keyframes: &[MapKeyframe]) -> Option<usize> {
    let distance = |a: &Pose, b: &Pose| {
        (a.translation - b.translation).length() + a.inverse().compose(b).angle_rad()
    };
    (1..keyframes.len().saturating_sub(2))
        .map(|i| {
            let nearest = keyframes
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, k)| distance(&k.world_from_camera, &keyframes[i].world_from_camera))
                .fold(f64::INFINITY, f64::min);
            (i, nearest)
        })
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn the_keyframe_closest_to_another_goes_first() {
        let at = |x: f64| MapKeyframe {
            frame: 0,
            slot: 1,
            world_from_camera: Pose { translation: DVec3::new(x, 0.0, 0.0), ..Pose::IDENTITY },
        };
        let keyframes = [0.0, 1.0, 1.3, 3.0, 3.01, 3.02].map(at);
        assert_eq!(least_useful(&keyframes), Some(3));
        assert_eq!(least_useful(&keyframes[..4]), Some(1));
        assert_eq!(least_useful(&keyframes[..3]), None);
    }
}
