#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod config;
mod error;
mod files;
mod names;
mod network;
mod output;
mod repair;
mod resize;
mod scores;
mod segmented;
mod segmenter;

pub use config::InputSize;
pub use error::SegmentError;
pub use files::{MAX_MODEL_BYTES, ModelFiles};
pub use resize::Turn;
pub use scores::{ClassProbability, LIKELIEST};
pub use segmented::Segmented;
pub use segmenter::{Segmentation, Segmenter, SegmenterOptions};
