//! From a sequence to a filled output folder: what `run` and `demo` share.
use crate::{
    args::{EngineArgs, OutputArgs},
    class_truth::ClassTruth,
    configuration::{self, Effective},
    engine::{self, Chosen},
    evaluation::{self, ViewScores},
    mesh_evaluation::{self, MeshProtocols, MeshTruth},
    novel,
    output::{
        checkpoint, classes,
        folder::OutputFolder,
        meshes,
        metrics::{
            AnchorFigures, ConfigurationRecord, MemoryFigures, Metrics, SequenceRecord, TimeFigures,
        },
        pictures, plot, sheet,
        timings::{Spread, Timing, write_csv},
        trajectory::write_tum,
    },
    progress::Progress,
    record::{RunRecord, config_file},
    resume::{self, Saved, Saver},
    screen::Screen,
};
use anyhow::{Context, Result};
use glam::DVec3;
use mte_slam_core::slam::{FrameReport, PoseEstimate, Slam, TrackingStatus, View};
use mte_slam_mesh::Mesh;
pub use mte_slam_report::evaluation::score_view;
use mte_slam_report::protocol::Protocol;
use mte_slam_types::{
    classes::ClassTable,
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::Sequence,
};
use pollster::block_on;
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
    time::Instant,
};

/// Everything that a run needs.
pub struct Job<'a> {
    /// What is read.
    pub sequence: Box<dyn Sequence>,
    /// How it was opened (engine fields are filled in here).
    pub record: RunRecord,
    /// The configuration.
    pub effective: Effective,
    /// Engine flags.
    pub engine: &'a EngineArgs,
    /// Output flags.
    pub output: &'a OutputArgs,
    /// Output folder when the flags name none.
    pub default_out: PathBuf,
    /// Labels that classes are scored against.
    pub class_truth: ClassTruth,
    /// True mesh, if there is one, or why there is none.
    pub truth_mesh: Result<MeshTruth, String>,
}

/// Do it.
pub fn run(mut job: Job, screen: Screen) -> Result<()> {
    // Checked before anything takes time.
    let path = job.output.out.clone().unwrap_or_else(|| job.default_out.clone());
    let saved = match job.output.resume {
        None => None,
        Some(_) => {
            let hash = configuration::hash(&job.effective.config)?;
            if resume::is_finished(&path, &job.record, &hash)? {
                screen.note(&format!("{}: finished before, nothing to do", path.display()));
                let json = fs::read_to_string(path.join("metrics.json")).unwrap_or_default();
                screen.result("", &json);
                return Ok(());
            }
            resume::find(&path)?
        }
    };
    let folder = OutputFolder::prepare(&path, job.output.force)?;
    let chosen = engine::start(job.engine)?;
    job.record.set_engine(&chosen.record);
    let frames = saved.as_ref().and_then(Saved::frames);
    let every = job.output.checkpoint_every;
    let mut saver = Saver::new(&path, every, &job.record, job.sequence.as_ref(), frames);
    let metrics = match work(job, &folder, chosen, saved, &mut saver, screen) {
        Ok(metrics) => metrics,
        Err(error) => return Err(saver.failed(error)),
    };
    folder.publish()?;
    saver.remove();
    let table = format!("{}\nwritten to {}\n", metrics.table(), path.display());
    screen.result(&table, &metrics.to_json()?);
    Ok(())
}

/// From the first frame, or the one after those of `saved`, to the staged results.
fn work(
    job: Job,
    folder: &OutputFolder,
    chosen: Chosen,
    saved: Option<Saved>,
    saver: &mut Saver,
    screen: Screen,
) -> Result<Metrics> {
    let start = Instant::now();
    let Job { mut sequence, mut record, effective, output, .. } = job;
    let info = sequence.info().clone();
    screen.note(&format!(
        "{}: {} frames of {}x{} ({}), {} classes; {}",
        info.name,
        info.frames,
        info.camera.width,
        info.camera.height,
        info.layout,
        info.classes.len(),
        chosen.note
    ));
    for warning in sequence.warnings() {
        screen.note(&format!("note: {warning}"));
    }
    let (mut slam, begun) = match saved {
        None => {
            let slam = block_on(Slam::new(chosen.engine, effective.config.clone(), &info))
                .context("the map cannot be set up")?;
            (slam, Processed::default())
        }
        Some(saved) => {
            let (slam, begun) =
                saved.resume(chosen.engine, &effective.config, sequence.as_mut(), &record)?;
            screen.note(&format!("resumed after {} of {} frames", slam.next_frame(), info.frames));
            (slam, begun)
        }
    };
    for note in &begun.notes {
        screen.note(&format!("note: {note}"));
    }
    if saver.begin(&output.invocation)? {
        screen
            .note("note: an interrupted run was left here, which --resume would have gone on with");
    }
    slam.set_clock(clock_s);

    let mut progress = screen.progress("tracking and mapping", info.frames);
    let saving = Some(&mut *saver);
    let processed =
        process(&mut slam, sequence.as_mut(), &record.dataset, begun, saving, &mut progress)?;
    progress.finish();
    let labelled = slam.labelled();
    let Processed { timings, earlier_s, notes, finish_s } = processed;
    record.colour_scale = slam.colour_registration().scale;
    // Without a single label the map's classes mean nothing: none are shown.
    let of_map = shown_classes(&slam);
    let estimates = slam.trajectory();
    let truth: Vec<_> = estimates.iter().map(|e| sequence.truth(e.frame)).collect();

    let mut metrics = Metrics {
        program: format!("mte-slam {}", env!("CARGO_PKG_VERSION")),
        sequence: sequence_record(&info, &record),
        configuration: Some(configuration_record(&effective)?),
        engine: Some(chosen.record),
        ..Metrics::default()
    };
    metrics.lost_frames =
        estimates.iter().filter(|e| e.status == TrackingStatus::Lost).map(|e| e.frame).collect();

    write_anchors(&slam, folder, &mut metrics)?;
    let truth_from_estimate =
        write_trajectory(folder, sequence.as_ref(), &estimates, &truth, &mut metrics)?;
    let class_truth = if labelled || info.classes.is_empty() {
        job.class_truth
    } else {
        ClassTruth::none("no pixel of any label image has a class", &info)
    };
    let mut scores = ViewScores::new(&info, class_truth, slam.colour_registration());
    if output.render_every > 0 {
        let chosen: Vec<_> = estimates.iter().step_by(output.render_every).copied().collect();
        let sequence = sequence.as_mut();
        render_views(&mut slam, sequence, folder, &chosen, &of_map, &mut scores, screen)?;
        let frames: Vec<usize> = chosen.iter().map(|e| e.frame).collect();
        let aligned = truth_from_estimate;
        novel::of_run(&mut slam, sequence, &record, &frames, aligned, &mut metrics, screen)?;
    }
    scores.report(pictures::unlabelled_id(&info.classes), &mut metrics);
    if let Some(renders) = metrics.renders.as_mut().filter(|_| !of_map.is_empty()) {
        let source = if slam.classes_by_anchors() { "anchors" } else { "head" };
        renders.classes_by = Some(source.to_owned());
    }
    write_classes(folder, &of_map, &scores, &metrics)?;
    if output.no_mesh {
        metrics.absent.insert("mesh", "--no-mesh was given".to_owned());
    } else {
        let resolution = output.mesh_resolution.unwrap_or(effective.config.mesh.resolution_m);
        let mesh = extract_mesh(&mut slam, resolution, screen)?;
        meshes::write(&mesh, &of_map, &mut |name, bytes| folder.write(name, bytes))?;
        match job.truth_mesh {
            Ok(truth) => {
                let depth_views = output.mesh_views;
                let wanted = MeshProtocols { depth_views, ..MeshProtocols::default() };
                let sequence = sequence.as_mut();
                screen.note("comparing the mesh with the true one");
                mesh_evaluation::score(mesh, truth, sequence, &wanted, &mut metrics);
            }
            Err(reason) => {
                metrics.absent.insert("mesh", reason);
            }
        }
    }

    let saved = block_on(slam.checkpoint()).context("the map cannot be saved")?;
    folder.write("checkpoint.safetensors", &saved.to_bytes())?;
    drop(saved);
    folder.write("timings.csv", write_csv(&timings).as_bytes())?;
    record.config_hash = configuration::hash(&effective.config)?;
    folder.write("config.toml", config_file(&effective.config, &record)?.as_bytes())?;

    metrics.warnings.splice(0..0, sequence.warnings().into_iter().chain(notes));
    let mut time = time_figures(&timings, finish_s, start);
    time.wall_s += earlier_s;
    time.checkpoints = saver.figures();
    metrics.time = Some(time);
    metrics.memory = Some(memory_figures(&slam));
    folder.write("metrics.json", metrics.to_json()?.as_bytes())?;
    Ok(metrics)
}

/// Seconds since the first call, for the reports of the core (which has no clock of its own).
pub fn clock_s() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// Restore the map of an output folder's checkpoint.
pub fn restore(out: &Path, engine: &EngineArgs, screen: Screen) -> Result<Slam> {
    let path = out.join("checkpoint.safetensors");
    let saved = checkpoint::read_file(&path)?;
    let chosen = engine::start(engine)?;
    let slam = block_on(Slam::restore(chosen.engine, &saved))
        .with_context(|| format!("{}: the map cannot be restored", path.display()))?;
    screen.note(&format!("{}: {}", slam.info().name, chosen.note));
    Ok(slam)
}

/// The classes that pictures and meshes of a map show: none where it has not seen a single label.
pub fn shown_classes(slam: &Slam) -> ClassTable {
    if slam.labelled() { slam.info().classes.clone() } else { ClassTable::default() }
}

/// What [`process`] tells.
#[derive(Default, Serialize, Deserialize)]
pub struct Processed {
    /// What each frame cost.
    pub timings: Vec<Timing>,
    /// Time of the last optimisation, over all keyframes \[s\].
    pub finish_s: f64,
    /// Time of the run before it was resumed \[s\].
    pub earlier_s: f64,
    /// What is to be said about resumptions.
    pub notes: Vec<String>,
}

/// Feed every frame after those that `begun` tells of, then optimise once more; a step of
/// `progress` a frame. `saver` writes checkpoints.
pub fn process(
    slam: &mut Slam,
    sequence: &mut dyn Sequence,
    recording: &str,
    begun: Processed,
    mut saver: Option<&mut Saver>,
    progress: &mut Progress,
) -> Result<Processed> {
    let frames = sequence.info().frames;
    let mut so_far = begun;
    for index in so_far.timings.len()..frames {
        let frame = match sequence.frame(index) {
            Ok(frame) => frame,
            Err(error) => {
                if let Some(saver) = &mut saver {
                    saver.before_failure(slam, &so_far, progress);
                }
                return Err(error).with_context(|| recording.to_owned());
            }
        };
        let begin = Instant::now();
        let report = block_on(slam.process(&frame))
            .with_context(|| format!("frame {} (index {index})", frame.number))?;
        so_far.timings.push(Timing {
            frame: index,
            tracking_s: report.tracking_s,
            // Without mapping the core's clock still sees some nanoseconds.
            mapping_s: if report.losses.is_some() { report.mapping_s } else { 0.0 },
            total_s: begin.elapsed().as_secs_f64(),
            status: status_name(report.status),
        });
        let done = index as u64 + 1;
        if progress.wants_message(done) {
            let message = live_message(slam, sequence, &report);
            progress.set(done, || message);
        }
        if let Some(saver) = &mut saver {
            saver.after_frame(slam, &so_far, frames, progress)?;
        }
    }
    let mut parts = 0;
    loop {
        let begin = Instant::now();
        let before = slam.finished_iterations();
        let more = block_on(slam.finish_step()).context("the last optimisation failed")?;
        so_far.finish_s += begin.elapsed().as_secs_f64();
        parts += 1;
        // Of a run that was resumed after all this, nothing is new.
        if slam.finished_iterations() > before
            && let Some(saver) = &mut saver
        {
            saver.after_part(slam, &so_far, (parts, more), progress)?;
        }
        if !more {
            return Ok(so_far);
        }
    }
}

fn live_message(slam: &Slam, sequence: &dyn Sequence, report: &FrameReport) -> String {
    let estimates = slam.trajectory();
    let truth: Vec<_> = estimates.iter().map(|e| sequence.truth(e.frame)).collect();
    let mut parts = Vec::new();
    if let Ok(score) = evaluation::trajectory(&estimates, &truth, |_| true) {
        parts.push(format!("ATE {:.2} cm", score.report.aligned_cm.rmse));
    }
    if let Some(losses) = &report.losses {
        parts.push(format!("loss {:.3}", losses.total));
    }
    let lost = estimates.iter().filter(|e| e.status == TrackingStatus::Lost).count();
    if lost > 0 {
        parts.push(format!("{lost} lost"));
    }
    parts.join("  ")
}

/// As timings.csv has it.
pub fn status_name(status: TrackingStatus) -> &'static str {
    match status {
        TrackingStatus::First => "first",
        TrackingStatus::Tracked => "tracked",
        TrackingStatus::Lost => "lost",
    }
}

/// The suppressor's statistics and their picture, where there is one.
fn write_anchors(slam: &Slam, folder: &OutputFolder, metrics: &mut Metrics) -> Result<()> {
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

/// Gives back what aligns the estimate with the truth; the identity where that is not known.
fn write_trajectory(
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

/// Render frames at their estimated poses; write the pictures, and score them.
fn render_views(
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
        let truth = scores.truth();
        let no_classes = ClassTable::default();
        trained.labels = trained.labels.map(|l| truth.of_map(&l));
        let registered = if slam.colour_registration().is_identity() {
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
    let frame = sequence.frame(estimate.frame).with_context(|| name)?;
    let view = block_on(slam.render(&estimate.world_from_camera, &camera))
        .with_context(|| format!("rendering frame {}", estimate.frame))?;
    Ok((frame, view))
}

/// Legend, and with figures the confusion matrix and the table of classes.
fn write_classes(
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

/// The mesh of the map, with progress.
pub fn extract_mesh(slam: &mut Slam, resolution_m: f64, screen: Screen) -> Result<Mesh> {
    let mut progress = screen.progress("meshing", 100);
    let mesh = block_on(slam.extract_mesh(resolution_m, &mut |part| {
        progress.set((part * 100.0) as u64, String::new);
    }))
    .context("the mesh cannot be extracted")?;
    progress.finish();
    Ok(mesh)
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
        labels: record.labels.clone(),
        truth_labels: record.truth_labels.clone(),
        classes: info.classes.len(),
    }
}

fn configuration_record(effective: &Effective) -> Result<ConfigurationRecord> {
    Ok(ConfigurationRecord {
        preset: effective.preset.clone(),
        hash: configuration::hash(&effective.config)?,
        seed: effective.config.seed,
        tracker: format!("{:?}", effective.config.tracking.tracker).to_lowercase(),
    })
}

fn time_figures(timings: &[Timing], last_optimisation_s: f64, start: Instant) -> TimeFigures {
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

fn memory_figures(slam: &Slam) -> MemoryFigures {
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
