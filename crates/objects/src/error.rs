//! What can be wrong with the input.
use mte_slam_mesh::{MeshError, PlyError};

/// Why objects could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjectsError {
    /// The mesh does not hold together, or its GLB cannot be written.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A PLY file cannot be read.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// A value cannot be worked with.
    #[error("{what}: found {found}, expected {expected}")]
    Invalid {
        /// What is wrong, for example `vertex 17` or `gap`.
        what: String,
        /// What was there.
        found: String,
        /// What should be there.
        expected: String,
    },
}

/// Returns [`ObjectsError::Invalid`].
pub(crate) fn invalid(
    what: impl ToString,
    found: impl ToString,
    expected: impl ToString,
) -> ObjectsError {
    ObjectsError::Invalid {
        what: what.to_string(),
        found: found.to_string(),
        expected: expected.to_string(),
    }
}
