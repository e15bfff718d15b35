//! What the odometry keeps of a frame that others are aligned with.
use super::{features::Corners, pyramid::RgbdPyramid, thumbnail::Thumbnail};
use mte_slam_types::pose::Pose;

/// A frame that others are aligned with.
#[derive(Clone, Debug)]
pub struct OdometryKeyframe {
    /// Stable identifier, ascending in time.
    pub id: usize,
    /// `Frame::index`.
    pub frame: usize,
    /// Its present pose.
    pub world_from_camera: Pose,
    pub(super) pyramid: RgbdPyramid,
    pub(super) thumbnail: Thumbnail,
    pub(super) corners: Corners,
}
