//! What people want of a recording's files, as far as layouts read them.
use crate::{
    folder::Folder,
    intrinsics::{self, Intrinsics},
    order::FrameOrder,
};
use mte_slam_types::sequence::SequenceError;

/// Wishes for the reading of any layout.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wanted {
    /// The camera that is given in place of any file's.
    pub camera: Option<Intrinsics>,
    /// The order of listed frames.
    pub order: FrameOrder,
    /// Whether frames with missing images are an error, in place of being left out.
    pub strict: bool,
}

impl Wanted {
    /// Returns the camera that is given (with the unit of depth that a file says), or else that of
    /// the files, or else a default, which says that it is one.
    pub fn camera_or(
        &self,
        folder: &Folder,
        default: impl FnOnce() -> Result<Intrinsics, SequenceError>,
    ) -> Result<Intrinsics, SequenceError> {
        match (&self.camera, intrinsics::read(folder)?) {
            (Some(given), read) => {
                let depth_scale = read.and_then(|r| r.depth_scale);
                Ok(Intrinsics { depth_scale, ..given.clone() })
            }
            (None, Some(read)) => Ok(read),
            (None, None) => default(),
        }
    }
}
