//! How recordings reach the code: bytes by name ([`Source`]), frames by index ([`Sequence`]).
use crate::{
    frame::{Frame, SequenceInfo},
    pose::Pose,
};
use alloc::{string::String, vec::Vec};

/// Why a recording could not be read. Every variant names the file (or the folder) it is about.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SequenceError {
    /// A file is missing or its bytes could not be had.
    #[error("{file}: cannot be read: {reason}")]
    Read {
        /// File or folder.
        file: String,
        /// What went wrong.
        reason: String,
    },
    /// A file was read but is not what it should be.
    #[error("{file}{}: {field}: found {found}, expected {expected}", FrameSuffix(*.frame))]
    Invalid {
        /// File.
        file: String,
        /// The frame it belongs to, if any.
        frame: Option<u64>,
        /// What part of the file, for example `depth image width`.
        field: String,
        /// What was there.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// No known layout fits; the text says what was looked for.
    #[error("{folder}: no known layout: {reason}")]
    UnknownLayout {
        /// The folder.
        folder: String,
        /// What each layout would need.
        reason: String,
    },
    /// Frame index past the end.
    #[error("frame {index} asked for, the sequence has {frames}")]
    OutOfRange {
        /// What was asked for.
        index: usize,
        /// What there is.
        frames: usize,
    },
}

struct FrameSuffix(Option<u64>);

impl core::fmt::Display for FrameSuffix {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.0 {
            Some(n) => write!(f, " (frame {n})"),
            None => Ok(()),
        }
    }
}

/// Named bytes: a folder, a zip file, an HTTP folder, files dropped on a page. Names use `/`.
pub trait Source {
    /// A name for messages, for example the folder's path.
    fn name(&self) -> &str;
    /// All file names below the root, `/`-separated, in no particular order.
    fn list(&self) -> Result<Vec<String>, SequenceError>;
    /// The bytes of one file.
    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError>;
}

/// An RGB-D sequence.
pub trait Sequence {
    /// What is the same for all frames.
    fn info(&self) -> &SequenceInfo;
    /// Decode frame `index` (0-based).
    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError>;
    /// Labels of frame `index` alone, as in [`Frame::labels`].
    fn labels(&mut self, index: usize) -> Result<Option<Vec<u8>>, SequenceError> {
        Ok(self.frame(index)?.labels)
    }
    /// Ground-truth pose of frame `index` without decoding its images.
    fn truth(&self, index: usize) -> Option<Pose>;
    /// Time stamp of frame `index` \[s\] (the frame number where there are no stamps).
    fn time_s(&self, index: usize) -> f64;
    /// What was assumed, skipped or masked while reading so far, for people; one sentence each.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }
}
