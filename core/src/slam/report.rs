//! What a run says about its frames.
use crate::pose::Pose;
use serde::{Deserialize, Serialize};

/// How a frame's pose came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrackingStatus {
    /// The first frame: its pose defines the world.
    First,
    /// Located.
    Tracked,
    /// Not located; its pose is a guess and the map ignores it.
    Lost,
}

impl TrackingStatus {
    /// `first`, `tracked` or `lost`.
    pub fn name(self) -> &'static str {
        match self {
            TrackingStatus::First => "first",
            TrackingStatus::Tracked => "tracked",
            TrackingStatus::Lost => "lost",
        }
    }
}

/// A frame that has been tracked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tracked {
    /// How its pose came about.
    pub status: TrackingStatus,
    /// Its pose.
    pub world_from_camera: Pose,
    /// The odometer took the frame as a reference, so the map should have it, too.
    pub is_reference: bool,
}

/// The pose of one frame.
#[derive(Clone, Copy, Debug)]
pub struct PoseEstimate {
    /// `Frame::index`.
    pub frame: usize,
    /// Time stamp \[s\].
    pub time_s: f64,
    /// The pose.
    pub world_from_camera: Pose,
    /// How it came about.
    pub status: TrackingStatus,
}

/// Mean losses of the last mapping iteration, weighted as optimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Losses {
    /// Sum of the others.
    pub total: f64,
    /// Signed distance.
    pub sdf: f64,
    /// Rendered depth.
    pub depth: f64,
    /// Rendered colour.
    pub color: f64,
    /// Cross-entropy.
    pub semantic: f64,
}

/// What happened to a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// How its pose came about.
    pub status: TrackingStatus,
    /// Its pose at this moment; mapping may correct it later.
    pub world_from_camera: Pose,
    /// Time of tracking \[s\]; 0 without a clock ([`Pace::now_s`](super::Pace::now_s)).
    pub tracking_s: f64,
    /// Time of mapping \[s\]; 0 without a clock.
    pub mapping_s: f64,
    /// Time of both \[s\].
    pub total_s: f64,
    /// Losses, when the frame was mapped.
    pub losses: Option<Losses>,
    /// Whether it became a keyframe.
    pub keyframe: bool,
}
