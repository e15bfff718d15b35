//! What tracking a frame found.
use mte_slam_types::pose::Pose;

/// Why a frame counts as lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LostReason {
    /// The frame has next to no depth.
    NoDepth,
    /// Too few points agree with any reference.
    FewInliers,
    /// The pose is further from the last one than a camera moves.
    Jump,
}

/// How well a frame was aligned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// See [`Alignment::inliers`](crate::Alignment::inliers).
    pub inliers: usize,
    /// See [`Alignment::inlier_ratio`](crate::Alignment::inlier_ratio).
    pub inlier_ratio: f64,
    /// See [`Alignment::overlap`](crate::Alignment::overlap).
    pub overlap: f64,
    /// See [`Alignment::geometric_rmse_m`](crate::Alignment::geometric_rmse_m) \[m\].
    pub geometric_rmse_m: f64,
    /// See [`Alignment::photometric_rmse`](crate::Alignment::photometric_rmse).
    pub photometric_rmse: f64,
    /// See [`Alignment::conditioning`](crate::Alignment::conditioning).
    pub conditioning: f64,
    /// See [`Alignment::unconstrained`](crate::Alignment::unconstrained).
    pub unconstrained: usize,
    /// See [`Alignment::information`](crate::Alignment::information).
    pub information: [[f64; 6]; 6],
    /// Keyframes used.
    pub references: usize,
}

/// What [`Odometer::track`](crate::Odometer::track) found.
#[derive(Clone, Debug)]
pub struct OdometryResult {
    /// The pose; the prediction when the frame is lost.
    pub world_from_camera: Pose,
    /// How well it fits.
    pub quality: Quality,
    /// Whether the pose must not be used to map.
    pub lost: bool,
    /// Why, when lost.
    pub reason: Option<LostReason>,
    /// Whether it took several starts.
    pub recovered: bool,
    /// The identifier of the keyframe made from this frame, if any.
    pub keyframe: Option<usize>,
}
