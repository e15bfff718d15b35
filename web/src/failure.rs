//! Why a command was not followed.
use crate::{feed::FeedError, message::*, settings::SettingsError};
use mte_slam_core::{engine::EngineError, slam::SlamError};
use mte_slam_run::RunError;
use mte_slam_types::sequence::SequenceError;

/// See the module.
pub struct Failure(pub ErrorEvent);

impl Failure {
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Failure {
        Failure(ErrorEvent { kind, message: message.into(), resumable: false })
    }
}

impl From<EngineError> for Failure {
    fn from(e: EngineError) -> Failure {
        let kind = match &e {
            EngineError::NoAdapter { .. } | EngineError::NoDevice { .. } => ErrorKind::Adapter,
            EngineError::LimitsTooSmall { .. } => ErrorKind::Limits,
            EngineError::BufferTooLarge { .. } | EngineError::OutOfMemory { .. } => {
                ErrorKind::OutOfMemory
            }
            EngineError::DeviceLost { .. } => ErrorKind::DeviceLost,
            _ => ErrorKind::Engine,
        };
        Failure::new(kind, e.to_string())
    }
}

impl From<SlamError> for Failure {
    fn from(e: SlamError) -> Failure {
        match e {
            SlamError::Engine(e) => e.into(),
            SlamError::Config(e) => Failure::new(ErrorKind::BadSettings, e.to_string()),
            SlamError::Frame { .. } | SlamError::Checkpoint { .. } => {
                Failure::new(ErrorKind::BadFile, e.to_string())
            }
            SlamError::NoMap => Failure::new(ErrorKind::Command, e.to_string()),
            _ => Failure::new(ErrorKind::Engine, e.to_string()),
        }
    }
}

impl From<SequenceError> for Failure {
    fn from(e: SequenceError) -> Failure {
        Failure::new(ErrorKind::BadFile, e.to_string())
    }
}

impl From<SettingsError> for Failure {
    fn from(e: SettingsError) -> Failure {
        Failure::new(ErrorKind::BadSettings, e.0)
    }
}

impl From<FeedError> for Failure {
    fn from(e: FeedError) -> Failure {
        let mut failure = Failure::new(e.kind, e.message);
        // The map is as it was; the frame can be asked for again.
        failure.0.resumable = true;
        failure
    }
}

impl From<RunError<FeedError>> for Failure {
    fn from(e: RunError<FeedError>) -> Failure {
        match e {
            RunError::Input { error, .. } => error.into(),
            RunError::Frame { error, .. } | RunError::Finish(error) | RunError::Resume(error) => {
                error.into()
            }
        }
    }
}
