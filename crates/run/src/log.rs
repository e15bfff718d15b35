//! What a run keeps of its frames, for reports and for whoever resumes it.
use mte_slam_core::slam::{Losses, TrackingStatus};
use serde::{Deserialize, Serialize};

/// What a run keeps of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameLog {
    /// `Frame::index`.
    pub frame: usize,
    /// How its pose came about.
    pub status: TrackingStatus,
    /// Time of tracking \[s\].
    pub tracking_s: f64,
    /// Time of mapping \[s\]; 0 for a frame that was not mapped.
    pub mapping_s: f64,
    /// Time of both \[s\], without waiting for the frame.
    pub total_s: f64,
    /// Losses of the last mapping iteration, when the frame was mapped.
    pub losses: Option<Losses>,
    /// Keyframes kept after it.
    pub keyframes: usize,
    /// Anchors in use after it, where the suppressor runs.
    pub anchors: Option<u32>,
}

/// What a run keeps of itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Log {
    /// The frames so far.
    pub frames: Vec<FrameLog>,
    /// Time of the last optimisation, over all keyframes \[s\].
    pub finish_s: f64,
    /// Time of the run before it was resumed, from its first frame on \[s\].
    pub earlier_s: f64,
    /// What is to be said about resumptions, for people.
    pub notes: Vec<String>,
}
