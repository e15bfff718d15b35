//! From a sequence to a filled output folder: what `run` and `demo` share.
use crate::{
    args::{EngineArgs, OutputArgs},
    class_truth::ClassTruth,
    configuration::{self, Configured},
    engine::{self, StartedEngine},
    evaluation::ViewScores,
    host::Terminal,
    mesh_evaluation::{self, MeshProtocols, MeshTruth},
    novel,
    output::{folder::OutputFolder, meshes, metrics::Metrics, pictures, timings::write_csv},
    record::{RunRecord, config_file},
    restore::extract_mesh,
    results,
    resume::{self, Saved, Saver},
    screen::Screen,
    steps, views,
};
use anyhow::{Context, Result};
use mte_slam_core::slam::TrackingStatus;
use mte_slam_run::{Log, Run};
use mte_slam_types::sequence::Sequence;
use pollster::block_on;
use std::{fs, path::PathBuf, time::Instant};

/// Everything that a run needs.
pub struct RunSetup<'a> {
    /// What is read.
    pub sequence: Box<dyn Sequence>,
    /// How it was opened (engine fields are filled in here).
    pub record: RunRecord,
    /// The configuration.
    pub effective: Configured,
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

/// Maps a recording into an output folder, or resumes doing so.
pub fn run(mut setup: RunSetup, screen: Screen) -> Result<()> {
    // Checked before anything takes time.
    let path = setup.output.out.clone().unwrap_or_else(|| setup.default_out.clone());
    let saved = match setup.output.resume {
        None => None,
        Some(_) => {
            let hash = configuration::hash(&setup.effective.config)?;
            if resume::is_finished(&path, &setup.record, &hash)? {
                screen.note(&format!("{}: finished before, nothing to do", path.display()));
                let json = fs::read_to_string(path.join("metrics.json")).unwrap_or_default();
                screen.result("", &json);
                return Ok(());
            }
            resume::find(&path)?
        }
    };
    let folder = OutputFolder::prepare(&path, setup.output.force)?;
    let started = engine::start(setup.engine)?;
    setup.record.set_engine(&started.record);
    let frames = saved.as_ref().map(Saved::frames);
    let every = setup.output.checkpoint_every;
    let mut saver = Saver::new(&path, every, &setup.record, setup.sequence.as_ref(), frames);
    let metrics = match work(setup, &folder, started, saved, &mut saver, screen) {
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
    setup: RunSetup,
    folder: &OutputFolder,
    started: StartedEngine,
    saved: Option<Saved>,
    saver: &mut Saver,
    screen: Screen,
) -> Result<Metrics> {
    let start = Instant::now();
    let RunSetup { mut sequence, mut record, effective, output, .. } = setup;
    let info = sequence.info().clone();
    screen.note(&format!(
        "{}: {} frames of {}x{} ({}), {} classes; {}",
        info.name,
        info.frames,
        info.camera.width,
        info.camera.height,
        info.layout,
        info.classes.len(),
        started.note
    ));
    for warning in sequence.warnings() {
        screen.note(&format!("note: {warning}"));
    }
    let mut run = match saved {
        None => block_on(Run::new(started.engine, effective.config.clone(), &info))
            .context("the map cannot be set up")?,
        Some(saved) => {
            let (engine, config) = (started.engine, &effective.config);
            let run = saved.resume(engine, config, sequence.as_mut(), &record)?;
            screen.note(&format!("resumed after {} of {} frames", run.next_frame(), info.frames));
            run
        }
    };
    for note in &run.log().notes {
        screen.note(&format!("note: {note}"));
    }
    if saver.begin(&output.invocation)? {
        screen.note("note: an interrupted run was left here, which --resume would have continued");
    }
    let mut progress = screen.progress("tracking and mapping", info.frames);
    let mut terminal = Terminal::new(&mut progress, sequence.as_ref());
    let saving = Some(&mut *saver);
    steps::take_all(&mut run, sequence.as_mut(), &record.dataset, saving, &mut terminal)?;
    progress.finish();
    let (mut slam, Log { frames, finish_s, earlier_s, notes }) = run.into_parts();
    let timings = results::timings(&frames);
    let labelled = slam.labelled();
    record.color_scale = slam.color_registration().scale;
    // Without a single label the map's classes mean nothing: none are shown.
    let of_map = views::shown_classes(&slam);
    let estimates = slam.trajectory();
    let truth: Vec<_> = estimates.iter().map(|e| sequence.truth(e.frame)).collect();

    let mut metrics = Metrics {
        program: format!("mte-slam {}", env!("CARGO_PKG_VERSION")),
        sequence: results::sequence_record(&info, &record),
        configuration: Some(results::configuration_record(&effective)?),
        engine: Some(started.record),
        ..Metrics::default()
    };
    metrics.lost_frames =
        estimates.iter().filter(|e| e.status == TrackingStatus::Lost).map(|e| e.frame).collect();

    results::write_anchors(&slam, folder, &mut metrics)?;
    let truth_from_estimate =
        results::write_trajectory(folder, sequence.as_ref(), &estimates, &truth, &mut metrics)?;
    let class_truth = if labelled || info.classes.is_empty() {
        setup.class_truth
    } else {
        ClassTruth::none("no pixel of any label image has a class", &info)
    };
    let mut scores = ViewScores::new(&info, class_truth, slam.color_registration());
    if output.render_every > 0 {
        let rendered: Vec<_> = estimates.iter().step_by(output.render_every).copied().collect();
        let sequence = sequence.as_mut();
        views::render_views(&mut slam, sequence, folder, &rendered, &of_map, &mut scores, screen)?;
        let frames: Vec<usize> = rendered.iter().map(|e| e.frame).collect();
        let aligned = truth_from_estimate;
        novel::of_run(&mut slam, sequence, &record, &frames, aligned, &mut metrics, screen)?;
    }
    scores.report(pictures::unlabelled_id(&info.classes), &mut metrics);
    if let Some(renders) = metrics.renders.as_mut().filter(|_| !of_map.is_empty()) {
        let source = if slam.classes_by_anchors() { "anchors" } else { "head" };
        renders.classes_by = Some(source.to_owned());
    }
    results::write_classes(folder, &of_map, &scores, &metrics)?;
    if output.no_mesh {
        metrics.absent.insert("mesh", "--no-mesh was given".to_owned());
    } else {
        let resolution = output.mesh_resolution.unwrap_or(effective.config.mesh.resolution_m);
        let mesh = extract_mesh(&mut slam, resolution, screen)?;
        meshes::write(&mesh, &of_map, &mut |name, bytes| folder.write(name, bytes))?;
        match setup.truth_mesh {
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
    let mut time = results::time_figures(&timings, finish_s, start);
    time.wall_s += earlier_s;
    time.checkpoints = saver.figures();
    metrics.time = Some(time);
    metrics.memory = Some(results::memory_figures(&slam));
    folder.write("metrics.json", metrics.to_json()?.as_bytes())?;
    Ok(metrics)
}
