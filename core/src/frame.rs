//! What a sequence delivers.
use crate::{camera::Camera, classes::ClassTable, pose::Pose};
use alloc::{string::String, vec::Vec};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// An axis-aligned box in world coordinates \[m\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Smallest corner \[m\].
    pub min: DVec3,
    /// Largest corner \[m\].
    pub max: DVec3,
}

/// One RGB-D frame, row-major from the top left. All images have the size of the camera.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Position in the sequence as read (after `--start` and `--stride`).
    pub index: usize,
    /// The data set's own frame number.
    pub number: u64,
    /// Time stamp of the data set \[s\], or the frame number when it has none.
    pub time_s: f64,
    /// sRGB colour.
    pub color: Vec<[u8; 3]>,
    /// Depth along z in units of `SequenceInfo::depth_unit_m`; 0 is invalid.
    pub depth: Vec<u16>,
    /// Compact class indices ([`crate::classes::UNLABELLED`] where unknown), when there are labels.
    pub labels: Option<Vec<u8>>,
    /// Ground-truth `world_from_camera`, when known and finite.
    pub truth: Option<Pose>,
}

/// What is the same for all frames of a sequence.
#[derive(Clone, Debug)]
pub struct SequenceInfo {
    /// Name shown to people, for example the folder's name.
    pub name: String,
    /// Name of the layout, for example `replica`, `tum`, `7scenes`, `synthetic`.
    pub layout: &'static str,
    /// Pinhole camera of the (scaled, undistorted) images.
    pub camera: Camera,
    /// Metres per unit of `Frame::depth`.
    pub depth_unit_m: f64,
    /// Number of frames that `frame` accepts.
    pub frames: usize,
    /// Classes of the labels; empty without labels.
    pub classes: ClassTable,
    /// Scene bounds \[m\] in the ground truth's world frame, when the data set gives them.
    pub bounds: Option<Bounds>,
}
