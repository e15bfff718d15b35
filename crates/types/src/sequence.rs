//! How recordings reach the code: bytes by name ([`Source`]), frames by index ([`Sequence`]).
use crate::{
    frame::{Frame, SequenceInfo},
    pose::Pose,
};
use alloc::{boxed::Box, format, string::String, vec::Vec};

/// Why a recording could not be read. Every variant names the file (or the folder) it is about.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
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
    /// Returns a name for messages, for example the folder's path.
    fn name(&self) -> &str;
    /// Returns all file names below the root, `/`-separated, in no particular order.
    fn list(&self) -> Result<Vec<String>, SequenceError>;
    /// Returns what people should know of the files, such as those that are left out of the
    /// list and why; one sentence each.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
    /// Returns the bytes of one file.
    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError>;
    /// Returns the length of one file \[bytes\]. Reads all of it unless the source knows better.
    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        Ok(self.read(file)?.len() as u64)
    }
    /// `bytes` bytes of one file from `offset` on; an error where it ends before. Reads all of it
    /// unless the source knows better, as those of large files should.
    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        let whole = self.read(file)?;
        let part = usize::try_from(offset)
            .ok()
            .and_then(|first| whole.get(first..first.checked_add(bytes)?));
        part.map(<[u8]>::to_vec).ok_or_else(|| too_short(file, whole.len() as u64, offset, bytes))
    }
}

/// Returns the error of a [`Source::read_range`] that goes past the end of a file of `size` bytes.
pub fn too_short(file: &str, size: u64, offset: u64, bytes: usize) -> SequenceError {
    let reason = format!("{size} bytes long, {bytes} bytes from {offset} on were expected");
    SequenceError::Read { file: file.into(), reason }
}

impl<S: Sequence + ?Sized> Sequence for Box<S> {
    fn info(&self) -> &SequenceInfo {
        (**self).info()
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        (**self).frame(index)
    }

    fn labels(&mut self, index: usize) -> Result<Option<Vec<u8>>, SequenceError> {
        (**self).labels(index)
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        (**self).truth(index)
    }

    fn view_from(&mut self, index: usize, world_from_camera: &Pose) -> Option<Frame> {
        (**self).view_from(index, world_from_camera)
    }

    fn prior(&self, index: usize) -> Option<Pose> {
        (**self).prior(index)
    }

    fn time_s(&self, index: usize) -> f64 {
        (**self).time_s(index)
    }

    fn number(&self, index: usize) -> u64 {
        (**self).number(index)
    }

    fn warnings(&self) -> Vec<String> {
        (**self).warnings()
    }
}

/// An RGB-D sequence.
pub trait Sequence {
    /// What is the same for all frames.
    fn info(&self) -> &SequenceInfo;
    /// Decodes frame `index` (0-based).
    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError>;
    /// Returns labels of frame `index` alone, as in [`Frame::labels`].
    fn labels(&mut self, index: usize) -> Result<Option<Vec<u8>>, SequenceError> {
        Ok(self.frame(index)?.labels)
    }
    /// Ground-truth pose of frame `index` without decoding its images.
    fn truth(&self, index: usize) -> Option<Pose>;
    /// Returns the pose of frame `index` that the recording device estimated (`world_from_camera` in a
    /// world of its own, metres). It may drift: it is no truth to score against.
    fn prior(&self, index: usize) -> Option<Pose> {
        let _ = index;
        None
    }
    /// A frame from a pose that is not of the sequence, where it can be made: `index` names it.
    /// `None` inside solids, and for recordings.
    fn view_from(&mut self, index: usize, world_from_camera: &Pose) -> Option<Frame> {
        let _ = (index, world_from_camera);
        None
    }
    /// Time stamp of frame `index` \[s\] (the frame number where there are no stamps).
    fn time_s(&self, index: usize) -> f64;
    /// Returns the data set's own number of frame `index`, as in [`Frame::number`].
    fn number(&self, index: usize) -> u64 {
        index as u64
    }
    /// What was assumed, skipped or masked while reading so far, for people; one sentence each.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }
}
