//! What can be wrong with a model.

/// Why a segmentation network cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SegmentError {
    /// A file cannot be read.
    #[error("{file}: cannot be read: {reason}")]
    Read {
        /// File or folder.
        file: String,
        /// What went wrong.
        reason: String,
    },
    /// A file, or what an option says, is not what it should be.
    #[error("{file}: {field}: found {found}, expected {expected}")]
    Invalid {
        /// File.
        file: String,
        /// Which part of it.
        field: String,
        /// What was there.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// The model is larger than it may be.
    #[error(
        "{file}: the model has {} MiB, and {} MiB may be used for it: take a smaller one, or 8-bit \
         weights",
        bytes >> 20, limit >> 20
    )]
    TooLarge {
        /// File.
        file: String,
        /// Its size \[bytes\].
        bytes: u64,
        /// Largest size \[bytes\].
        limit: u64,
    },
    /// The network failed on an image.
    #[error("{model}: the network cannot be run: {reason}")]
    Run {
        /// The model's file.
        model: String,
        /// What the runtime says.
        reason: String,
    },
}

pub(crate) fn invalid(
    file: &str,
    field: &str,
    found: impl ToString,
    expected: impl ToString,
) -> SegmentError {
    SegmentError::Invalid {
        file: file.into(),
        field: field.into(),
        found: found.to_string(),
        expected: expected.to_string(),
    }
}
