//! The whole system: frames in, poses and a map out.
//!
//! [`Slam::process`] (`process.rs`) takes a frame through the paper's figure 2: it tracks the frame, decides
//! whether it is mapped and stays as a keyframe, and optimises map and poses over a window of
//! keyframes, with the fused features and the anchors as supervision. [`Slam::finish`] optimises
//! over all of them at the end. Nothing here waits for a clock, a file or a thread: the host owns
//! those.
//!
//! What an optimisation does is planned by pure functions (`plan.rs`) and then recorded
//! (`mapping.rs`).
mod admission;
mod bounds;
mod checkpoint;
mod checkpoint_file;
mod class_counts;
mod error;
mod finish;
mod keyframes;
mod live;
mod mapping;
mod output;
mod pace;
mod parameters;
mod plan;
mod points;
mod process;
mod registration;
mod report;
mod resume;
mod semantics;
mod storage;
mod system;
mod tracking;

#[cfg(all(test, feature = "std"))]
mod tests;

pub use checkpoint::{Checkpoint, Dtype, Tensor};
pub use error::SlamError;
pub use keyframes::MapKeyframe;
pub use live::{LiveMesh, MeshChunk};
pub use output::View;
pub use pace::{Pace, Turn, Unpaced};
pub use parameters::ParameterCounts;
pub use report::{FrameReport, Losses, PoseEstimate, TrackingStatus};
pub use resume::Resuming;
pub use system::Slam;
