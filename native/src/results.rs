//! What a run leaves in its output folder beside maps and views: trajectory, anchors, classes and
//! the figures of metrics.json.
use crate::{
    configuration::{self, Configured},
    evaluation::{self, ViewScores},
    output::{
        classes,
        folder::OutputFolder,
        metrics::{
            AnchorFigures, ConfigurationRecord, MemoryFigures, Metrics, SequenceRecord, TimeFigures,
        },
        plot,
        timings::{Spread, Timing},
        trajectory::write_tum,
    },
    record::RunRecord,
};
use anyhow::Result;
use glam::DVec3;
use mte_slam_core::slam::{PoseEstimate, Slam, TrackingStatus};
use mte_slam_report::protocol::Protocol;
use mte_slam_run::FrameLog;
use mte_slam_types::{classes::ClassTable, frame::SequenceInfo, pose::Pose, sequence::Sequence};
use std::time::Instant;

/// Writes the picture of the suppressor's statistics, where there is one.
pub fn write_anchors(slam: &Slam, folder: &OutputFolder, metrics: &mut Metrics) -> Result<()> {
    let Some((_, last)) = slam.anchor_history().last() else { return Ok(()) };
    let history: Vec<_> = slam
        .anchor_history()
        .iter()
        .map(|(frame, c)| (*frame, c.alive, c.spawned, c.dropped, c.merged))
        .collect();
    let limit = slam.config().suppressor.anchors;
    let svg = plot::anchors_svg(&slam.info().name, &history, limit);
    folder.write("anchors.svg", svg.as_bytes())?;
    metrics.anchors =
        Some(AnchorFigures { protocol: Protocol::Anchors, limit, last: *last, history });
    Ok(())
}

/// Writes the trajectory as text and as a picture, and scores it. Returns what aligns the estimate
/// with the truth; the identity where that is not known.
pub fn write_trajectory(
    folder: &OutputFolder,
    sequence: &dyn Sequence,
    estimates: &[PoseEstimate],
    truth: &[Option<Pose>],
    metrics: &mut Metrics,
) -> Result<Pose> {
    let text = write_tum(estimates.iter().map(|e| (e.time_s, e.world_from_camera)));
    folder.write("trajectory.txt", text.as_bytes())?;
    let known: Vec<_> =
        estimates.iter().zip(truth).filter_map(|(e, t)| Some((e.time_s, (*t)?))).collect();
    if !known.is_empty() {
        folder.write("trajectory_gt.txt", write_tum(known.iter().copied()).as_bytes())?;
    }
    let score = evaluation::trajectory(estimates, truth, |_| true);
    let aligned = score.as_ref().map_or(Pose::IDENTITY, |s| s.truth_from_estimate);
    let mut subtitle = format!("{} frames", estimates.len());
    let mut points: Vec<DVec3> =
        estimates.iter().map(|e| e.world_from_camera.translation).collect();
    match &score {
        Ok(score) => {
            for p in &mut points {
                *p = score.truth_from_estimate.transform_point(*p);
            }
            subtitle += &format!(
                ", ATE RMSE {:.3} cm aligned (as drawn), {:.3} cm unaligned",
                score.report.aligned_cm.rmse, score.report.unaligned_cm.rmse
            );
        }
        Err(reason) => {
            subtitle += ", no ground truth";
            metrics.absent.insert("trajectory", reason.to_string());
        }
    }
    let lost: Vec<bool> = estimates.iter().map(|e| e.status == TrackingStatus::Lost).collect();
    if lost.contains(&true) {
        subtitle += &format!(", {} lost", metrics.lost_frames.len());
    }
    let up = estimates.iter().map(|e| -e.world_from_camera.rotation.y_axis).sum();
    let true_points: Vec<DVec3> = known.iter().map(|(_, p)| p.translation).collect();
    let title = &sequence.info().name;
    let picture = plot::Plot {
        title,
        subtitle: &subtitle,
        estimate: &points,
        lost: &lost,
        truth: &true_points,
        up,
    };
    folder.write("trajectory.svg", plot::svg(&picture).as_bytes())?;
    metrics.trajectory = score.ok().map(|s| s.report);
    if lost.contains(&true) {
        let not_lost = |e: &PoseEstimate| e.status != TrackingStatus::Lost;
        metrics.trajectory_without_lost =
            evaluation::trajectory(estimates, truth, not_lost).ok().map(|s| s.report);
    }
    Ok(aligned)
}

/// Writes the legend and, with figures, the confusion matrix and the table of classes.
pub fn write_classes(
    folder: &OutputFolder,
    of_map: &ClassTable,
    scores: &ViewScores,
    metrics: &Metrics,
) -> Result<()> {
    let (table, matrix) = scores.confusion();
    let figures = metrics.semantics.as_ref();
    let shown = if figures.is_some() { table } else { of_map };
    if !shown.is_empty() {
        folder.write("legend.png", &classes::legend(shown, figures)?)?;
    }
    if let Some(figures) = figures {
        folder.write("confusion.png", &classes::confusion(table, matrix)?)?;
        let csv = classes::csv(figures, metrics.input_labels.as_ref());
        folder.write("classes.csv", csv.as_bytes())?;
    }
    Ok(())
}

/// What each frame cost, as timings.csv has it.
pub fn timings(frames: &[FrameLog]) -> Vec<Timing> {
    let timing = |f: &FrameLog| Timing {
        frame: f.frame,
        tracking_s: f.tracking_s,
        mapping_s: f.mapping_s,
        total_s: f.total_s,
        status: f.status.name(),
    };
    frames.iter().map(timing).collect()
}

/// What was read, for metrics.json.
pub fn sequence_record(info: &SequenceInfo, record: &RunRecord) -> SequenceRecord {
    SequenceRecord {
        name: info.name.clone(),
        layout: info.layout.to_owned(),
        frames: info.frames,
        width_pixels: info.camera.width,
        height_pixels: info.camera.height,
        start: record.start,
        stride: record.stride,
        scale: record.scale,
        labels: record.labels_name(),
        truth_labels: record.truth_labels.clone(),
        classes: info.classes.len(),
    }
}

/// How it was run, for metrics.json.
pub fn configuration_record(effective: &Configured) -> Result<ConfigurationRecord> {
    Ok(ConfigurationRecord {
        preset: effective.preset.clone(),
        hash: configuration::hash(&effective.config)?,
        seed: effective.config.seed,
        tracker: format!("{:?}", effective.config.tracking.tracker).to_lowercase(),
    })
}

/// What a run that began at `start` cost, for metrics.json.
pub fn time_figures(timings: &[Timing], last_optimisation_s: f64, start: Instant) -> TimeFigures {
    TimeFigures {
        protocol: Protocol::Time,
        tracking: Spread::of(timings.iter().skip(1).map(|t| t.tracking_s)),
        mapping: Spread::of(timings.iter().map(|t| t.mapping_s).filter(|s| *s > 0.0)),
        total: Spread::of(timings.iter().map(|t| t.total_s)),
        last_optimisation_s,
        wall_s: start.elapsed().as_secs_f64(),
        checkpoints: None,
    }
}

/// What the map and the program took, for metrics.json.
pub fn memory_figures(slam: &Slam) -> MemoryFigures {
    let (peak_host_bytes, peak_host_unknown) = match crate::memory::peak_host_bytes() {
        Ok(bytes) => (Some(bytes), None),
        Err(reason) => (None, Some(reason)),
    };
    MemoryFigures {
        protocol: Protocol::Memory,
        peak_host_bytes,
        peak_host_unknown,
        device_bytes: slam.memory_bytes() as u64,
        peak_device_bytes: slam.peak_memory_bytes(),
    }
}
