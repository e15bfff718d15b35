//! The map and what runs over it.
//!
//! [`Map`] is the state: parameter tensors, stored frames, anchors, counters; what a checkpoint
//! keeps. [`Scratch`] holds the buffers of one batch: every pass writes them before it reads them.
//! [`passes`] record what a batch does with both; [`fusion`] and [`suppressor`] are the paper's two
//! modules (III-A, III-B). None of them touches the engine but to make buffers, upload first values
//! and read results back.
mod batch;
pub mod fusion;
mod parameters;
pub mod passes;
mod sample_head;
mod saved;
mod scratch;
mod slots;
mod state;
pub mod suppressor;

/// Whether this build has the per-sample class head (feature `sample-head`).
pub const HAS_SAMPLE_HEAD: bool = cfg!(feature = "sample-head");

pub use batch::{Batch, ClassWeight, Rates, SemanticSupervision};
pub use fusion::{Fusion, FusionLayer, FusionScratch};
pub use parameters::ParameterTensor;
pub use sample_head::SampleHead;
#[cfg(feature = "sample-head")]
pub use sample_head::SampleLayer;
pub(crate) use sample_head::SampleScratch;
pub(crate) use saved::Counters;
pub use scratch::Scratch;
pub(crate) use scratch::WINDOW_MAX;
pub use slots::{FrameFormat, FrameSlots, TokenGrid, pose_words};
pub(crate) use slots::{color_words, pose_from_words};
pub use state::Map;
pub use suppressor::{AnchorCounts, Suppressor};
