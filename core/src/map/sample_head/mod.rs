//! The per-sample class head, built as SNI-SLAM's: what deferred decoding is measured against.
//!
//! Samples go through the perceptron in parts of the batch, so that its activations fit a binding
//! whatever the batch; each part's gradients are added to the same rows of partial sums.
//!
//! It is a baseline of a thousand lines: only builds with the feature `sample-head` have it.
//! Elsewhere `absent.rs` stands for it, so that the passes need not know.
#[cfg(feature = "sample-head")]
mod head;
#[cfg(feature = "sample-head")]
mod passes;

#[cfg(not(feature = "sample-head"))]
mod absent;

#[cfg(feature = "sample-head")]
pub(crate) use head::SampleScratch;
#[cfg(feature = "sample-head")]
pub use head::{SampleHead, SampleLayer};
#[cfg(feature = "sample-head")]
pub(super) use passes::{classes_at, record_backward, record_classes, record_step};

#[cfg(not(feature = "sample-head"))]
pub use absent::SampleHead;
#[cfg(not(feature = "sample-head"))]
pub(crate) use absent::SampleScratch;
#[cfg(not(feature = "sample-head"))]
pub(super) use absent::{classes_at, record_backward, record_classes, record_step};
