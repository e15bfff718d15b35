//! Rendered views that are scored in other ways than at the poses of the run: views from poses that
//! the map never saw, and SNI-SLAM's one frame.
use crate::{
    class_truth::ClassTruth,
    evaluation::{ViewScores, score_view},
    metrics::{InferenceFigures, Metrics, NovelFigures, SniFigures},
    protocol::Protocol,
};
use anyhow::{Context, Result};
use mte_slam_core::{config::Inference, slam::Slam};
use mte_slam_dataset::{ColorFormat, RecordingWriter, ReplicaWriter};
use mte_slam_metrics::ConfusionMatrix;
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::Sequence,
};
use pollster::block_on;
use std::io;

/// Folder of such views beside a recording's own.
pub const FOLDER: &str = "novel";
/// How far to the side a view is moved \[m\], and how far up.
const ASIDE_M: f64 = 0.25;
const UP_M: f64 = 0.1;
/// How far it is turned back \[degrees\].
const TURN_DEG: f64 = 15.0;

/// A pose near another that sees the same from elsewhere: moved to one side and turned towards the
/// other, in turns.
pub fn moved(pose: &Pose, k: usize) -> Pose {
    let side = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
    let turn = -side * TURN_DEG.to_radians();
    // In the camera's frame: x right, y down.
    pose.compose(&Pose::from_twist(&[side * ASIDE_M, -UP_M, 0.0, 0.0, turn, 0.0]))
}

/// Writes views from poses beside a sequence's path, spread along it, as a recording in Replica's
/// layout in the folder for such views.
pub fn write(
    sequence: &mut dyn Sequence,
    views: usize,
    write: &mut dyn FnMut(&str, &[u8]) -> io::Result<()>,
) -> Result<()> {
    let frames = sequence.info().frames;
    let mut made = Vec::new();
    for k in 0..views {
        let index = k * frames / views;
        let pose = sequence.truth(index).map(|pose| moved(&pose, k));
        made.extend(pose.and_then(|pose| sequence.view_from(index, &pose)));
    }
    if made.is_empty() {
        return Ok(());
    }
    let info = SequenceInfo { frames: made.len(), ..sequence.info().clone() };
    let mut writer = ReplicaWriter::new(&info, ColorFormat::Png, |name, bytes| {
        write(&format!("{FOLDER}/{name}"), bytes)
    });
    for (index, view) in made.into_iter().enumerate() {
        writer.write(&Frame { index, number: index as u64, ..view })?;
    }
    writer.finish()?;
    Ok(())
}

/// Scores views that the sequence makes near `frames`, where it can make any; otherwise notes why
/// there are none.
///
/// # Errors
/// A view cannot be rendered or scored.
pub fn near_frames(
    slam: &mut Slam,
    sequence: &mut dyn Sequence,
    frames: &[usize],
    truth_from_estimate: Pose,
    metrics: &mut Metrics,
) -> Result<()> {
    let mut views = Vec::new();
    for (k, &index) in frames.iter().enumerate() {
        let pose = sequence.truth(index).map(|pose| moved(&pose, k));
        views.extend(pose.and_then(|pose| sequence.view_from(index, &pose)));
    }
    if views.is_empty() {
        let reason = "there is no recording of other poses (a folder `novel` in the recording)";
        metrics.absent.insert("novel_views", reason.to_owned());
        return Ok(());
    }
    let info = sequence.info().clone();
    let truth = ClassTruth::of_input("built-in", &info);
    let protocol = format!(
        "true poses of rendered frames, moved {} cm to one side and {} cm up and turned {TURN_DEG} \
         degrees to the other, in turns; truth ray-cast from the scene; without depth input",
        100.0 * ASIDE_M,
        100.0 * UP_M
    );
    let mut views = views.into_iter();
    let next = &mut || Ok(views.next());
    let protocol = (Protocol::NovelNearFrames, protocol);
    metrics.novel_views = score(slam, &info, truth, next, truth_from_estimate, protocol)?;
    Ok(())
}

/// Scores novel views of a recording in the same world as that of the run; `views` is the recording,
/// `labels` the same opened again for the true labels, and `name` is for messages.
///
/// # Errors
/// A view cannot be read, rendered or scored.
pub fn of_recording(
    slam: &mut Slam,
    name: &str,
    views: &mut dyn Sequence,
    truth: ClassTruth,
    truth_from_estimate: Pose,
    metrics: &mut Metrics,
) -> Result<()> {
    let info = views.info().clone();
    let protocol =
        format!("all poses of {name}, none of which the map has seen; without depth input");
    let mut index = 0;
    let next = &mut || -> Result<Option<Frame>> {
        while index < info.frames {
            index += 1;
            if views.truth(index - 1).is_some() {
                return Ok(Some(views.frame(index - 1)?));
            }
        }
        Ok(None)
    };
    let protocol = (Protocol::NovelRecording, protocol);
    metrics.novel_views = score(slam, &info, truth, next, truth_from_estimate, protocol)?;
    if metrics.novel_views.is_none() {
        metrics.absent.insert("novel_views", format!("{name}: no frame has a true pose"));
    }
    Ok(())
}

/// Renders and score the views that `next` gives, at their true poses in the map's world.
fn score(
    slam: &mut Slam,
    info: &SequenceInfo,
    truth: ClassTruth,
    next: &mut dyn FnMut() -> Result<Option<Frame>>,
    truth_from_estimate: Pose,
    (protocol, sentence): (Protocol, String),
) -> Result<Option<NovelFigures>> {
    let estimate_from_truth = truth_from_estimate.inverse();
    let mut scores = ViewScores::new(info, truth, slam.color_registration());
    let mut views = 0;
    while let Some(frame) = next()? {
        let Some(pose) = frame.truth else { continue };
        let pose = estimate_from_truth.compose(&pose);
        let mut view = block_on(slam.render(&pose, &info.camera))
            .with_context(|| format!("rendering novel view {}", frame.index))?;
        score_view(&mut scores, &frame, &mut view)?;
        views += 1;
    }
    if views == 0 {
        return Ok(None);
    }
    let mut figures = Metrics::default();
    scores.report(0, &mut figures);
    let Metrics { depth, color, semantics, .. } = figures;
    Ok(Some(NovelFigures {
        protocol_id: protocol.id(),
        protocol: sentence,
        views,
        depth,
        color,
        semantics,
    }))
}

/// The classes of the frames `rendered`, at estimated poses, by the nearest anchors or the head.
pub fn by_inference(
    slam: &mut Slam,
    inference: Inference,
    sequence: &mut dyn Sequence,
    truth: ClassTruth,
    rendered: &[usize],
    metrics: &mut Metrics,
    done: &mut dyn FnMut(usize),
) -> Result<()> {
    let name = match inference {
        Inference::Anchors => "anchors",
        Inference::Head => "head",
    };
    if inference == Inference::Anchors && !slam.anchors_settled() {
        let reason = "the map has no anchors that have settled: the suppressor was off, there were \
                      no labels, or the run is not complete";
        metrics.absent.insert("semantics_by_inference", reason.to_owned());
        return Ok(());
    }
    slam.set_inference(inference);
    let info = sequence.info().clone();
    let poses: Vec<Pose> = slam.trajectory().iter().map(|e| e.world_from_camera).collect();
    let mut scores = ViewScores::new(&info, truth, slam.color_registration());
    for (i, &index) in rendered.iter().enumerate() {
        let pose = poses.get(index).with_context(|| {
            format!("frame {index}: found a map of {} frames, expected more", poses.len())
        })?;
        let mut view = block_on(slam.render(pose, &info.camera))
            .with_context(|| format!("rendering frame {index}"))?;
        score_view(&mut scores, &sequence.frame(index)?, &mut view)?;
        done(i + 1);
    }
    let mut figures = Metrics::default();
    scores.report(0, &mut figures);
    match figures.semantics {
        Some(semantics) => {
            let again = InferenceFigures { inference: name, semantics };
            metrics.semantics_by_inference = Some(again);
        }
        None => {
            let reason = figures.absent.remove("semantics").unwrap_or_default();
            metrics.absent.insert("semantics_by_inference", reason);
        }
    }
    Ok(())
}

/// What SNI-SLAM's script prints as mIoU: the first frame alone, rendered at its true pose with its
/// true depth.
pub fn sni(
    slam: &mut Slam,
    sequence: &mut dyn Sequence,
    class_truth: &mut ClassTruth,
    metrics: &mut Metrics,
) -> Result<()> {
    let mut absent = |reason: &str| {
        metrics.absent.insert("semantics_sni", reason.to_owned());
        Ok(())
    };
    let frame = sequence.frame(0)?;
    let Some(pose) = frame.truth else { return absent("the first frame has no true pose") };
    let Some(labels) = class_truth.of_frame(&frame)? else {
        return absent("the first frame has no true labels");
    };
    if !slam.labelled() {
        return absent("the map has seen no label");
    }
    let view = block_on(slam.render_at_depth(&pose, &frame)).context("rendering frame 0")?;
    let mut matrix = ConfusionMatrix::new(class_truth.table.len());
    matrix.add(&labels, &class_truth.of_map(&view.class))?;
    let Some(report) = matrix.report() else { return absent("the first frame has no true labels") };
    metrics.semantics_sni = Some(SniFigures {
        protocol: Protocol::Sni,
        frame: 0,
        miou_percent: report.miou_percent,
        miou_classes: report.miou_classes,
        pixel_accuracy_percent: report.pixel_accuracy_percent,
    });
    Ok(())
}
