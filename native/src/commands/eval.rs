//! `mte-slam eval`: the figures again, from files alone.
use crate::{
    args::{ClassArgs, CullChoice, EvalArgs, InferenceChoice, MiouProtocol, SelectionArgs},
    class_truth::ClassTruth,
    evaluation::{self, ViewScores},
    input,
    mesh_evaluation::{self, MeshProtocols, MeshTruth},
    novel,
    output::{
        folder::replace_file, metrics::Metrics, pictures::unlabelled_id, trajectory::read_tum,
    },
    record::{self, RunRecord},
    restore::restore,
    results::sequence_record,
    screen::Screen,
};
use anyhow::{Context, Result, anyhow, bail};
use image::{ColorType, DynamicImage};
use mte_slam_core::{config::Inference, slam::View};
use mte_slam_mesh::read_ply;
use mte_slam_metrics::PosePair;
use mte_slam_odometry::ColorRegistration;
use mte_slam_report::novel::{FOLDER as NOVEL_FOLDER, by_inference, sni as sni_frame};
use mte_slam_types::{
    classes::{ClassTable, UNLABELLED},
    frame::SequenceInfo,
    pose::Pose,
    sequence::Sequence,
};
use std::path::Path;

/// Time stamps that differ by less name the same frame \[s\].
const SAME_STAMP_S: f64 = 1e-5;

/// Evaluate an output folder.
pub fn run(args: &EvalArgs, screen: Screen) -> Result<()> {
    let out = &args.out;
    if !out.is_dir() {
        bail!(
            "{}: found no folder of that name, expected the output folder of a run",
            out.display()
        );
    }
    let record = record::read_run(out)?.unwrap_or_default();
    let of_run = record.selection();
    let mut selection = SelectionArgs {
        layout: args.layout.clone(),
        labels: args.labels.clone().unwrap_or_else(|| record.labels.clone()),
        truth_labels: args.truth_labels.clone(),
        classes: ClassArgs {
            classes: args.classes.classes.clone().or(record.classes.clone()),
            unlabelled: args.classes.unlabelled.or(record.unlabelled),
        },
        ..of_run
    };
    let mut sequence = match input::open(&args.dataset, &selection, screen) {
        // Where the run's labels have gone the rest can still be measured.
        Err(reason) if args.labels.is_none() && selection.labels != "dataset" => {
            screen.note(&format!("note: without the run's own labels: {reason:#}"));
            selection.labels = "none".to_owned();
            input::open(&args.dataset, &selection, screen)?
        }
        opened => opened?,
    };
    let info = sequence.info().clone();
    let mut class_truth = input::open_truth(&args.dataset, &selection, &info)?;
    let novel_folder = args.dataset.join(NOVEL_FOLDER);
    let novel = match &args.novel {
        Some(path) => Some(path.as_path()),
        None => Some(novel_folder.as_path())
            .filter(|f| f.is_dir() && out.join("checkpoint.safetensors").is_file()),
    };
    let truth_mesh = MeshTruth::find(args.mesh.as_deref(), &args.dataset)?;
    let (labels, truth_labels) = (selection.labels.clone(), class_truth.name.clone());
    let record = RunRecord { labels, truth_labels, ..record };
    let mut metrics = Metrics {
        program: format!("mte-slam {} eval", env!("CARGO_PKG_VERSION")),
        sequence: sequence_record(&info, &record),
        lost_frames: lost_frames(&out.join("timings.csv")),
        ..Metrics::default()
    };
    let truth_from_estimate = evaluate_trajectory(out, sequence.as_ref(), &mut metrics)?;
    let registration = ColorRegistration { scale: record.color_scale };
    let sni = args.miou_protocol == MiouProtocol::Sni;
    let rendered = rendered_frames(out, info.frames);
    if sni || novel.is_some() || args.inference.is_some() {
        let mut slam = restore(out, &args.engine, screen)?;
        if sni {
            sni_frame(&mut slam, sequence.as_mut(), &mut class_truth, &mut metrics)?;
        }
        if let Some(path) = novel {
            let aligned = truth_from_estimate;
            novel::recorded(&mut slam, path, &selection, aligned, &mut metrics, screen)?;
        }
        if let Some(choice) = args.inference {
            let truth = input::open_truth(&args.dataset, &selection, &info)?;
            let inference = match choice {
                InferenceChoice::Anchors => Inference::Anchors,
                InferenceChoice::Head => Inference::Head,
            };
            let mut progress = screen.progress("rendering again", rendered.len());
            by_inference(
                &mut slam,
                inference,
                sequence.as_mut(),
                truth,
                &rendered,
                &mut metrics,
                &mut |done| progress.set(done as u64, String::new),
            )?;
            progress.finish();
        }
    }
    let views = (registration, &rendered[..]);
    evaluate_renders(out, sequence.as_mut(), class_truth, views, screen, &mut metrics)?;
    let path = out.join("mesh.ply");
    match truth_mesh {
        Err(reason) => {
            metrics.absent.insert("mesh", reason);
        }
        Ok(_) if !path.is_file() => {
            metrics.absent.insert("mesh", format!("there is no {}", path.display()));
        }
        Ok(truth) => {
            let name = path.display();
            let bytes = std::fs::read(&path).with_context(|| format!("{name}: cannot be read"))?;
            let mesh = read_ply(&bytes).with_context(|| format!("{name}: not a mesh"))?;
            drop(bytes);
            let wanted = protocols(args);
            let sequence = sequence.as_mut();
            screen.note("comparing the mesh with the true one");
            let views = mesh_evaluation::score(mesh, truth, sequence, &wanted, &mut metrics);
            if let Some(path) = &args.write_views {
                let views = views.ok_or_else(|| {
                    anyhow!("--write-views {}: the mesh was not judged in any", path.display())
                })?;
                replace_file(path, serde_json::to_string(&views)?.as_bytes())?;
            }
        }
    }
    metrics.warnings.splice(0..0, sequence.warnings());
    let json = metrics.to_json()?;
    let path = out.join("eval.json");
    replace_file(&path, json.as_bytes())?;
    screen.result(&format!("{}\nwritten to {}\n", metrics.table(), path.display()), &json);
    Ok(())
}

/// Which figures of the mesh the flags ask for.
fn protocols(args: &EvalArgs) -> MeshProtocols {
    MeshProtocols {
        eslam: args.cull.contains(&CullChoice::Eslam),
        coslam: args.cull.contains(&CullChoice::Coslam),
        frustum: args.cull.contains(&CullChoice::Frustum),
        icp: args.icp,
        depth_views: args.mesh_views,
        seed: args.eval_seed,
    }
}

/// Returns what aligns the estimate with the truth; the identity where that is not known.
fn evaluate_trajectory(out: &Path, sequence: &dyn Sequence, metrics: &mut Metrics) -> Result<Pose> {
    let path = out.join("trajectory.txt");
    let name = path.display().to_string();
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("{name}: cannot be read; expected the output folder of a run"))?;
    let poses = read_tum(&name, &text)?;
    let frames = sequence.info().frames;
    let mut stamps: Vec<(f64, usize)> = (0..frames).map(|i| (sequence.time_s(i), i)).collect();
    stamps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let frame_at = |t: f64| -> Option<usize> {
        let i = stamps.partition_point(|(s, _)| *s < t - SAME_STAMP_S);
        stamps.get(i).filter(|(s, _)| (s - t).abs() <= SAME_STAMP_S).map(|(_, i)| *i)
    };
    let matched: Vec<(usize, Pose)> =
        poses.iter().filter_map(|(t, pose)| Some((frame_at(*t)?, *pose))).collect();
    if matched.is_empty() {
        bail!(
            "{name}: found {} poses, none with the time stamp of a frame of {}; expected the \
             output of a run on this recording",
            poses.len(),
            sequence.info().name
        );
    }
    let pairs = |keep: &dyn Fn(usize) -> bool| -> Vec<PosePair> {
        let kept = matched.iter().filter(|(i, _)| keep(*i));
        kept.filter_map(|(i, estimate)| {
            Some(PosePair { estimate: *estimate, truth: sequence.truth(*i)? })
        })
        .collect()
    };
    let mut truth_from_estimate = Pose::IDENTITY;
    match evaluation::trajectory_of_pairs(&pairs(&|_| true)) {
        Ok(score) => {
            truth_from_estimate = score.truth_from_estimate;
            metrics.trajectory = Some(score.report);
        }
        Err(reason) => {
            metrics.absent.insert("trajectory", reason.to_string());
        }
    }
    if !metrics.lost_frames.is_empty() {
        let found = pairs(&|i| !metrics.lost_frames.contains(&i));
        let score = evaluation::trajectory_of_pairs(&found);
        metrics.trajectory_without_lost = score.ok().map(|s| s.report);
    }
    Ok(truth_from_estimate)
}

/// Frames of which a run has left pictures.
fn rendered_frames(out: &Path, frames: usize) -> Vec<usize> {
    let folder = out.join("renders");
    (0..frames).filter(|i| folder.join(format!("{i:06}.color.png")).is_file()).collect()
}

fn evaluate_renders(
    out: &Path,
    sequence: &mut dyn Sequence,
    class_truth: ClassTruth,
    (registration, rendered): (ColorRegistration, &[usize]),
    screen: Screen,
    metrics: &mut Metrics,
) -> Result<()> {
    let info = sequence.info().clone();
    let recorded = recorded_renders(out).unwrap_or_default();
    let unlabelled = recorded["unlabelled_id"].as_u64().and_then(|id| id.try_into().ok());
    let unlabelled = unlabelled.unwrap_or(unlabelled_id(&class_truth.table));
    let folder = out.join("renders");
    let mut scores = ViewScores::new(&info, class_truth, registration);
    let mut progress = screen.progress("comparing pictures", rendered.len());
    for (i, &index) in rendered.iter().enumerate() {
        let truth = scores.truth();
        let view = read_view(&folder, index, &info, &truth.table, unlabelled)?;
        let mut frame = sequence.frame(index)?;
        if frame.labels.is_none() {
            frame.labels = sequence.labels(index)?;
        }
        let (frame, labels) = scores.registered(&frame)?;
        scores.add(&frame, &view, labels.as_deref())?;
        progress.set(i as u64 + 1, String::new);
    }
    progress.finish();
    scores.report(unlabelled, metrics);
    if let Some(renders) = &mut metrics.renders {
        renders.classes_by = recorded["classes_by"].as_str().map(str::to_owned);
    }
    Ok(())
}

/// What the run's metrics.json says of its pictures, which alone do not say which id has no meaning
/// where the map knew other classes than the true labels.
fn recorded_renders(out: &Path) -> Option<serde_json::Value> {
    let text = std::fs::read_to_string(out.join("metrics.json")).ok()?;
    let mut json: serde_json::Value = serde_json::from_str(&text).ok()?;
    Some(json["renders"].take())
}

/// The pictures of a frame; without a class picture all pixels are unlabelled.
fn read_view(
    folder: &Path,
    index: usize,
    info: &SequenceInfo,
    table: &ClassTable,
    unlabelled: u16,
) -> Result<View> {
    let read = |kind: &str, expected: ColorType| -> Result<DynamicImage> {
        let path = folder.join(format!("{index:06}.{kind}.png"));
        let name = path.display();
        let image = image::open(&path).with_context(|| format!("{name}: not a whole picture"))?;
        let (w, h) = (info.camera.width, info.camera.height);
        if (image.width(), image.height()) != (w, h) {
            bail!(
                "{name} (frame {index}): size: found {}x{}, expected {w}x{h} as in the recording",
                image.width(),
                image.height()
            );
        }
        if image.color() != expected {
            bail!("{name} (frame {index}): found {:?}, expected {expected:?}", image.color());
        }
        Ok(image)
    };
    let color = read("color", ColorType::Rgb8)?.into_rgb8().pixels().map(|p| p.0).collect();
    let depth_m = read("depth", ColorType::L16)?
        .into_luma16()
        .iter()
        .map(|&mm| (f64::from(mm) / 1000.0) as f32)
        .collect();
    let has_classes = folder.join(format!("{index:06}.class.png")).is_file();
    let class = if has_classes && !table.is_empty() {
        compact(&read("class", ColorType::L16)?, table, unlabelled)
    } else {
        vec![UNLABELLED; info.camera.pixels()]
    };
    Ok(View { camera: info.camera, color, depth_m, class })
}

fn compact(image: &DynamicImage, table: &ClassTable, unlabelled: u16) -> Vec<u8> {
    let mut index_of_raw = table.index_of_raw();
    index_of_raw.insert(unlabelled, UNLABELLED);
    let index = |raw: &u16| index_of_raw.get(raw).copied().unwrap_or(UNLABELLED);
    image.to_luma16().iter().map(index).collect()
}

/// Frames with the status `lost`, if the file is there.
fn lost_frames(timings: &Path) -> Vec<usize> {
    let text = std::fs::read_to_string(timings).unwrap_or_default();
    text.lines()
        .filter(|line| line.ends_with(",lost"))
        .filter_map(|line| line.split(',').next()?.parse().ok())
        .collect()
}
