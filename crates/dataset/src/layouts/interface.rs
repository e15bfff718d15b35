//! What a layout is to the code: the files by which it is recognised, and how they are read.
use super::wanted::Wanted;
use crate::{entries::Entries, folder::Folder};
use mte_slam_types::sequence::SequenceError;

/// A kind of file that marks a layout, as messages show it, and how many of them there are.
pub(crate) type Mark = (&'static str, usize);

/// Where the parts of a recording lie, as the documentation's table shows it (in Markdown).
pub(crate) struct Parts {
    /// What the name leaves open, or nothing.
    pub about: &'static str,
    /// Colour images.
    pub color: &'static str,
    /// Depth images and their unit.
    pub depth: &'static str,
    /// Ground-truth poses.
    pub poses: &'static str,
    /// Label images.
    pub labels: &'static str,
}

/// A layout of files. Each has a file of its own and a line in the registry (`layouts/mod.rs`).
pub(crate) trait LayoutFiles: Sync {
    /// Returns the name on the command line.
    fn name(&self) -> &'static str;

    /// Says where the parts of a recording lie.
    fn parts(&self) -> Parts;

    /// Counts the files by which the layout is recognised: it fits when there are some of each.
    /// Messages show them to people whose recording fits no layout.
    fn marks(&self, folder: &Folder, camera_given: bool) -> Vec<Mark>;

    /// Reads everything but the images: frames, camera and poses.
    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError>;

    /// Returns whether it is taken only when no other layout fits.
    fn is_last_resort(&self) -> bool {
        false
    }
}
