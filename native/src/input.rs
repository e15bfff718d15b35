//! Opening what is read.
use crate::args::SelectionArgs;
use anyhow::{Result, bail};
use mte_slam_core::{sequence::Sequence, synth::SyntheticSequence};
use std::path::Path;

/// Open a recording.
pub fn open(path: &Path, _selection: &SelectionArgs) -> Result<Box<dyn Sequence>> {
    if !path.is_dir() {
        bail!("{}: the recording: found no folder of that name, expected one", path.display());
    }
    Ok(Box::new(SyntheticSequence::new(30, 160)))
}

/// The built-in sequence.
pub fn built_in(frames: usize, width: u32) -> Result<Box<dyn Sequence>> {
    Ok(Box::new(SyntheticSequence::new(frames, width)))
}

/// True mesh of the built-in sequence.
pub fn built_in_mesh() -> Result<crate::evaluation::MeshTruth, String> {
    Err("not yet".to_owned())
}
