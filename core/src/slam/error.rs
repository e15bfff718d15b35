//! What a run can fail with.
use crate::{
    config::ConfigError, engine::EngineError, mesh::MeshError, track::odometry::OdometryError,
};
use alloc::string::String;

/// What a run could not do.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SlamError {
    /// The engine failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The configuration is not usable.
    #[error("configuration: {0}")]
    Config(#[from] ConfigError),
    /// Tracking could not even be tried.
    #[error(transparent)]
    Odometry(#[from] OdometryError),
    /// Meshing failed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A frame does not fit the sequence.
    #[error("frame {frame}: {field}: found {found}, expected {expected}")]
    Frame {
        /// `Frame::index`.
        frame: usize,
        /// What part of it.
        field: &'static str,
        /// What it is.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// Asked for something that needs a map before the first frame.
    #[error("there is no map yet: process a frame first")]
    NoMap,
    /// The map holds values that are not finite.
    #[error("the map is not finite after frame {frame}: lower the learning rates")]
    NotFinite {
        /// Last frame mapped.
        frame: usize,
    },
    /// A checkpoint that cannot be continued from.
    #[error("checkpoint: {field}: found {found}, expected {expected}")]
    Checkpoint {
        /// Tensor or metadata entry.
        field: String,
        /// What is there.
        found: String,
        /// What should be there.
        expected: String,
    },
}
