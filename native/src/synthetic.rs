//! Built-in sequences as files.
use crate::{input, output::new_folder::NewFolder};
use anyhow::{Context, Result};
use mte_slam_dataset::{ColorFormat, RecordingWriter, ReplicaWriter};
use mte_slam_mesh::write_ply;
use mte_slam_report::novel;
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{frame::SequenceInfo, sequence::Sequence};
use std::path::Path;

/// Writes a built-in sequence, `novel_views` views from other poses, and the true mesh to a folder, in
/// Replica's (NICE-SLAM's) layout, without any loss: a run reads the very frames that `demo` sees.
/// `written` receives how many frames are done.
pub fn write(
    dir: &Path,
    options: SyntheticOptions,
    novel_views: usize,
    mut written: impl FnMut(usize),
) -> Result<SequenceInfo> {
    let target = NewFolder::prepare(dir)?;
    let mut sequence = SyntheticSequence::new(options);
    let info = sequence.info().clone();
    let mut writer =
        ReplicaWriter::new(&info, ColorFormat::Png, |name, bytes| target.write(name, bytes));
    for index in 0..info.frames {
        writer.write(&sequence.frame(index)?)?;
        written(index + 1);
    }
    writer.finish()?;
    novel::write(&mut sequence, novel_views, &mut |name, bytes| target.write(name, bytes))?;
    let mesh = input::true_mesh(sequence.ground_truth_mesh()).mesh;
    let ply = write_ply(&mesh).context("the true mesh cannot be written")?;
    target.write("mesh.ply", &ply).context("mesh.ply: cannot be written")?;
    target.publish()?;
    Ok(info)
}
