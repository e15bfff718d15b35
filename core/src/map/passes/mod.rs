//! What is recorded for a batch of rays.
//!
//! An iteration of mapping is [`record_forward`], [`record_backward`] and [`record_step`]; of
//! semantics alone [`record_forward`], `record_semantic_backward` and `record_semantic_step`;
//! of a pose [`record_forward`], [`record_backward`] and [`record_pose_step`]. Queries ask the field
//! at points of their own and read the answers back.
mod backward;
mod forward;
mod query;
mod step;

pub use backward::record_backward;
pub(crate) use backward::record_semantic_backward;
pub use forward::record_forward;
pub use query::{align, upload_pixels};
pub(crate) use query::{query_distances, query_surface};
pub(crate) use step::record_semantic_step;
pub use step::{record_pose_step, record_step};
