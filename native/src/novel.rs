//! Views from poses that a map never saw: where they are found.
use crate::{
    args::{SegmenterArgs, SelectionArgs},
    class_truth::ClassTruth,
    input,
    output::metrics::Metrics,
    record::RunRecord,
    screen::Screen,
};
use anyhow::Result;
use mte_slam_core::slam::Slam;
use mte_slam_report::novel::{FOLDER, near_frames, of_recording};
use mte_slam_types::{pose::Pose, sequence::Sequence};
use std::path::Path;

/// Scores the novel views of a run: those in the folder beside its recording, or made by the sequence
/// near `frames`; otherwise notes why there are none.
pub fn of_run(
    slam: &mut Slam,
    sequence: &mut dyn Sequence,
    record: &RunRecord,
    frames: &[usize],
    truth_from_estimate: Pose,
    metrics: &mut Metrics,
    screen: Screen,
) -> Result<()> {
    let beside = Path::new(&record.dataset).join(FOLDER);
    if beside.is_dir() {
        let selection = record.selection();
        return recorded(slam, &beside, &selection, truth_from_estimate, metrics, screen);
    }
    near_frames(slam, sequence, frames, truth_from_estimate, metrics)
}

/// Scores the views of a recording in the same world as that of the run.
pub fn recorded(
    slam: &mut Slam,
    recording: &Path,
    selection: &SelectionArgs,
    truth_from_estimate: Pose,
    metrics: &mut Metrics,
    screen: Screen,
) -> Result<()> {
    // Of the run's recording: which frames, labels and layout. Of any: how it is read.
    let selection = SelectionArgs {
        layout: None,
        frames: None,
        stride: 1,
        start: 0,
        labels: "dataset".to_owned(),
        truth_labels: None,
        features: None,
        segmentation: SegmenterArgs {
            groups: selection.segmentation.groups.clone(),
            ..SegmenterArgs::default()
        },
        ..selection.clone()
    };
    let mut views = input::open(recording, &selection, screen)?;
    let name = recording.display().to_string();
    let truth = if slam.labelled() && !views.info().classes.is_empty() {
        let labels = input::open(recording, &selection, Screen { quiet: true, ..screen })?;
        ClassTruth::of_sequence(&name, labels, slam.info())?
    } else {
        ClassTruth::none("there are no labels", slam.info())
    };
    of_recording(slam, &name, views.as_mut(), truth, truth_from_estimate, metrics)
}
