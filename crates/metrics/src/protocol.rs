//! Ids of the protocols of this crate's figures. Figures compare only where their ids are equal: the
//! sentence beside an id is for people, and may hold counts or be reworded.
//!
//! An id is `FAMILY/VARIANT@VERSION`. The version rises with every change after which figures no
//! longer compare with those from before.
use alloc::{format, string::String};

/// [`crate::ate`].
pub const ATE: &str = "ate/rigid@1";
/// [`crate::DepthMeter`].
pub const DEPTH_VIEWS: &str = "depth-l1/views@1";
/// [`crate::PsnrMeter`].
pub const PSNR_VIEWS: &str = "psnr/views@1";
/// [`crate::SemanticMeter`].
pub const MIOU: &str = "miou/all-images@1";
/// [`crate::BoundaryMeter`].
pub const BOUNDARY: &str = "boundary/3-pixels@1";
/// [`crate::ConsistencyMeter`].
pub const CONSISTENCY: &str = "class-changes/next-view@1";
/// [`crate::evaluate_surface`], of meshes that are not known to be culled.
pub const SURFACE: &str = "surface/as-given@1";

/// [`crate::rpe`] over `delta` steps.
pub fn rpe(delta: usize) -> String {
    format!("rpe/{delta}-steps@1")
}

/// [`crate::depth_l1`] in `views` virtual views.
pub fn depth_virtual(views: usize) -> String {
    format!("depth-l1/virtual-{views}@1")
}
