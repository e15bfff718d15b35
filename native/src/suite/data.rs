//! The recordings of a suite that are built in.
use crate::{input, output::new_folder::NewFolder};
use anyhow::{Context, Result};
use mte_slam_core::{
    dataset::{ColorFormat, RecordingWriter, ReplicaWriter},
    mesh::write_ply,
    sequence::Sequence,
    synth::{SyntheticOptions, SyntheticSequence},
};
use std::path::Path;

/// Write a built-in sequence and its mesh to a folder, in Replica's (NICE-SLAM's) layout, without
/// any loss: a run reads the very frames.
pub fn write(dir: &Path, options: SyntheticOptions) -> Result<()> {
    let target = NewFolder::prepare(dir)?;
    let mut sequence = SyntheticSequence::new(options);
    let info = sequence.info().clone();
    let mut writer =
        ReplicaWriter::new(&info, ColorFormat::Png, |name, bytes| target.write(name, bytes));
    for index in 0..info.frames {
        writer.write(&sequence.frame(index)?)?;
    }
    writer.finish()?;
    let mesh = input::true_mesh(sequence.ground_truth_mesh()).mesh;
    let ply = write_ply(&mesh).context("the true mesh cannot be written")?;
    target.write("mesh.ply", &ply).context("mesh.ply: cannot be written")?;
    target.publish()
}
