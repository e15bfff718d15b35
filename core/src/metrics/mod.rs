//! Stand-in.
mod image;
mod semantic;
mod trajectory;
pub use image::*;
pub use semantic::*;
pub use trajectory::*;
/// Stand-in.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// Stand-in.
    #[error("{what}: found {found}, expected {expected}")]
    Size {
        /// Stand-in.
        what: &'static str,
        /// Stand-in.
        found: usize,
        /// Stand-in.
        expected: usize,
    },
}
