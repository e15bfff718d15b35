#![doc = include_str!("../README.md")]
//! # Protocols
//!
//! Published tables mix protocols, so a figure without the name of its protocol means nothing.
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

mod boundary;
mod bvh;
mod consistency;
mod distance;
mod image;
pub mod protocol;
mod semantic;
mod surface;
#[cfg(test)]
mod test_shapes;
mod trajectory;
mod virtual_views;

pub use boundary::{BOUNDARY_PIXELS, BoundaryMeter, BoundaryReport};
pub use consistency::{ConsistencyMeter, ConsistencyReport};
pub use distance::distances_to_surface;
pub use image::{DepthMeter, DepthReport, MAX_PSNR_DB, PsnrMeter, PsnrReport};
pub use semantic::{ConfusionMatrix, SMALL_SHARE_PERCENT, SemanticMeter, SemanticReport};
pub use surface::{
    SurfaceFigures, SurfaceOptions, SurfaceReport, evaluate_surface, icp, sample_surface,
};
pub use trajectory::{
    AteReport, ErrorSummary, PosePair, RigidAlignment, RpeReport, TrajectoryError, align_rigid,
    ate, rpe,
};
pub use virtual_views::{
    DepthViews, MeshDepthReport, VIRTUAL_CAMERA, culling_views, depth_l1, depth_views,
};

/// Why images or meshes cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// Two images of a comparison differ in size.
    #[error("{what}: found {found}, expected {expected}")]
    Size {
        /// What was counted.
        what: &'static str,
        /// How many there were.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A mesh that no samples can be drawn from.
    #[error("{mesh} mesh: found {found}, expected a surface with a finite, positive area")]
    NoSurface {
        /// `estimated` or `true`.
        mesh: &'static str,
        /// What is wrong with it.
        found: alloc::string::String,
    },
    /// No virtual view can be compared.
    #[error(
        "virtual views: found none that counts, expected {wanted}; {rejected} poses see parts of \
         the true surface that no frame has seen"
    )]
    NoViews {
        /// Views asked for.
        wanted: usize,
        /// Poses that were rejected.
        rejected: usize,
    },
    /// The alignment before a comparison failed.
    #[error("alignment of the meshes: {0}")]
    Alignment(TrajectoryError),
}
