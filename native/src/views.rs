//! Views of a map: rendered, scored against the recording, and written as pictures.
use crate::{
    evaluation::ViewScores,
    output::{folder::OutputFolder, pictures, sheet},
    screen::Screen,
};
use anyhow::{Context, Result};
use mte_slam_core::slam::{PoseEstimate, Slam, View};
pub use mte_slam_report::evaluation::score_view;
use mte_slam_types::{classes::ClassTable, frame::Frame, sequence::Sequence};
use pollster::block_on;

/// The classes that pictures and meshes of a map show: none where it has not seen a single label.
pub fn shown_classes(slam: &Slam) -> ClassTable {
    if slam.labelled() { slam.info().classes.clone() } else { ClassTable::default() }
}

/// Renders frames at their estimated poses; writes the pictures, and scores them.
pub fn render_views(
    slam: &mut Slam,
    sequence: &mut dyn Sequence,
    folder: &OutputFolder,
    chosen: &[PoseEstimate],
    of_map: &ClassTable,
    scores: &mut ViewScores,
    screen: Screen,
) -> Result<()> {
    let info = sequence.info().clone();
    let mut progress = screen.progress("rendering", chosen.len());
    for (i, estimate) in chosen.iter().enumerate() {
        let (frame, mut view) = render_frame(slam, sequence, estimate)?;
        let stem = format!("renders/{:06}", estimate.frame);
        write_view(&view, of_map, &mut |kind, bytes| {
            folder.write(&format!("{stem}.{kind}.png"), bytes)
        })?;
        let (mut trained, labels) = score_view(scores, &frame, &mut view)?;
        scores.follow(&trained, &view, &estimate.world_from_camera);
        let truth = scores.truth();
        let no_classes = ClassTable::default();
        trained.labels = trained.labels.map(|l| truth.of_map(&l));
        let registered = if slam.color_registration().is_identity() {
            ""
        } else {
            "; input colour resampled to the depth camera"
        };
        let title = format!(
            "{}  frame {}  rendered at the estimated pose, without depth input{registered}",
            info.name, estimate.frame
        );
        let picture = sheet::sheet(&sheet::Sheet {
            title: &title,
            frame: &trained,
            depth_unit_m: info.depth_unit_m,
            view: &view,
            table: if of_map.is_empty() { &no_classes } else { &truth.table },
            true_labels: labels.as_deref(),
            own_truth: truth.is_own(),
        })?;
        folder.write(&format!("{stem}.sheet.png"), &picture)?;
        progress.set(i as u64 + 1, String::new);
    }
    progress.finish();
    Ok(())
}

/// A frame, and its view from the map: at the estimated pose, without depth input.
pub fn render_frame(
    slam: &mut Slam,
    sequence: &mut dyn Sequence,
    estimate: &PoseEstimate,
) -> Result<(Frame, View)> {
    let name = sequence.info().name.clone();
    let camera = sequence.info().camera;
    let mut frame = sequence.frame(estimate.frame).with_context(|| name)?;
    // A network labels the frames that are mapped, and others when asked.
    if frame.labels.is_none() {
        frame.labels = sequence.labels(estimate.frame)?;
    }
    let view = block_on(slam.render(&estimate.world_from_camera, &camera))
        .with_context(|| format!("rendering frame {}", estimate.frame))?;
    Ok((frame, view))
}

/// Colour, depth and, with classes, class pictures of a view, given to `write` with their kind.
pub fn write_view(
    view: &View,
    table: &ClassTable,
    write: &mut dyn FnMut(&str, &[u8]) -> Result<()>,
) -> Result<()> {
    let (w, h) = (view.camera.width, view.camera.height);
    write("color", &pictures::color_png(w, h, &view.color)?)?;
    write("depth", &pictures::depth_png(w, h, &view.depth_m)?)?;
    if !table.is_empty() {
        write("class", &pictures::class_png(w, h, &view.class, table)?)?;
        write("class_color", &pictures::class_color_png(w, h, &view.class, table)?)?;
    }
    Ok(())
}
