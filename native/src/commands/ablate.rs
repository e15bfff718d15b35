//! `mte-slam ablate`: the paper's Table VI on any labelled recording.
//!
//! All rows and seeds go through the same pieces as `run`, in this process, one after another. A
//! finished run is kept in OUT/runs, so an interrupted ablation continues where it ended.
use crate::{
    args::{AblateArgs, AblationRow},
    class_truth::ClassTruth,
    configuration,
    engine::{self, StartedEngine},
    errors::usage,
    evaluation::{self, ViewScores},
    host::Terminal,
    input::{self, Prepared},
    output::{
        ablation::{Ablation, ClassScores, FinishedRun, Row, RunKey, Variant},
        folder::replace_file,
        metrics::Metrics,
        pictures,
    },
    progress::{Progress, clock},
    results,
    screen::Screen,
    steps, views,
};
use anyhow::{Context, Result, bail};
use mte_slam_core::{
    config::{Config, Head, Inference},
    map::HAS_SAMPLE_HEAD,
    slam::TrackingStatus,
};
use mte_slam_run::{Log, Run};
use mte_slam_types::sequence::Sequence;
use pollster::block_on;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

/// Keys that rows and seeds decide.
const OURS: [&str; 5] =
    ["seed", "fusion.enabled", "fusion.local", "suppressor.enabled", "semantics.head"];

/// What a row is, and the name of its files.
fn variant(row: AblationRow) -> (Variant, &'static str) {
    let of = |name: &str, fusion, suppressor| Variant {
        name: name.to_owned(),
        fusion,
        local: fusion,
        suppressor,
        head: Head::Ray,
    };
    match row {
        AblationRow::Neither => (of("neither", false, false), "neither"),
        AblationRow::Mtff => (of("MTFF", true, false), "mtff"),
        AblationRow::Frs => (of("FRS", false, true), "frs"),
        AblationRow::Both => (of("both", true, true), "both"),
        AblationRow::NoLocal => {
            (Variant { local: false, ..of("both, no local module", true, true) }, "no-local")
        }
        AblationRow::SampleHead => {
            (Variant { head: Head::Sample, ..of("per-sample head", false, false) }, "sample-head")
        }
    }
}

/// One run of the plan.
struct Planned {
    config: Config,
    key: RunKey,
    path: PathBuf,
    finished: Option<FinishedRun>,
}

/// Measures every row with every seed, and writes the table.
pub fn run(args: &AblateArgs, screen: Screen) -> Result<()> {
    if let Some(seed) = args.config.seed {
        usage!("--seed {seed}: ablate runs the seeds 1 to N, expected --seeds N");
    }
    for text in &args.config.set {
        let key = text.split('=').next().unwrap_or_default().trim();
        if OURS.contains(&key) {
            usage!("--set {text}: `{key}` is what ablate changes itself, expected another key");
        }
    }
    let rows = &args.rows;
    if let Some((i, row)) = rows.iter().enumerate().find(|(i, row)| rows[..*i].contains(row)) {
        usage!("--rows: found {row:?} twice (entry {}), expected every row once", i + 1);
    }
    if rows.contains(&AblationRow::SampleHead) && !HAS_SAMPLE_HEAD {
        usage!("--rows sample-head: expected a build with the feature `sample-head`");
    }
    let Prepared { mut sequence, effective, mut class_truth, record } =
        input::prepare(&args.dataset, &args.selection, &args.config, screen)?;
    let info = sequence.info().clone();
    check_labels(args, sequence.as_mut(), &mut class_truth)?;

    let name = input::folder_name(&args.dataset);
    let default_out = || Path::new("out").join(format!("{name}-{}-ablation", effective.preset));
    let out = args.out.clone().unwrap_or_else(default_out);
    check_folder(&out)?;
    let first_engine = engine::start(&args.engine)?;
    let engine_record = first_engine.record.clone();
    let seeds: Vec<u32> = (1..=args.seeds as u32).collect();
    let key = RunKey {
        program: format!("mte-slam {}", record.version),
        row: String::new(),
        seed: 0,
        config_hash: String::new(),
        dataset: record.dataset.clone(),
        layout: record.layout.clone(),
        start: record.start,
        stride: record.stride,
        frames: record.frames,
        scale: record.scale,
        labels: record.labels_name(),
        truth_labels: record.truth_labels.clone(),
        features: record.features.clone(),
        classes: record.classes.clone(),
        unlabelled: record.unlabelled,
        render_every: args.render_every,
        engine: engine_record.kind.clone(),
        adapter: engine_record.adapter.clone(),
    };
    // Seed by seed, so that rows can be compared long before the last run.
    let mut plan = Vec::new();
    for &seed in &seeds {
        for &row in rows {
            plan.push(planned(&out, &key, &effective.config, row, seed)?);
        }
    }
    fs::create_dir_all(out.join("runs")).with_context(|| {
        format!("{}: the output folder cannot be written; choose another with --out", out.display())
    })?;

    let kept = plan.iter().filter(|p| p.finished.is_some()).count();
    screen.note(&format!(
        "{}: {} frames of {}x{} ({}), {} classes; {}; {} runs, {kept} of them kept in {}",
        info.name,
        info.frames,
        info.camera.width,
        info.camera.height,
        info.layout,
        info.classes.len(),
        first_engine.note,
        plan.len(),
        out.join("runs").display()
    ));
    let mut engine = Some(first_engine);
    let views = info.frames.div_ceil(args.render_every);
    let steps = info.frames + views;
    let mut progress = screen.progress("ablation", steps * (plan.len() - kept));
    let runs = plan.len();
    let begin = Instant::now();
    let mut done = 0;
    for (i, planned) in plan.iter_mut().enumerate() {
        if planned.finished.is_some() {
            continue;
        }
        let label =
            format!("run {}/{runs} ({}, seed {})", i + 1, planned.key.row, planned.key.seed);
        progress.begin_part((done * steps) as u64, label.clone());
        let started = match engine.take() {
            Some(started) => started,
            None => engine::start(&args.engine)?,
        };
        let (finished, truth) =
            run_one(planned, started, sequence.as_mut(), class_truth, &mut progress)
                .with_context(|| label.clone())?;
        class_truth = truth;
        let json = serde_json::to_string_pretty(&finished)? + "\n";
        replace_file(&planned.path, json.as_bytes())?;
        done += 1;
        let left = begin.elapsed().mul_f64((runs - kept - done) as f64 / done as f64);
        progress.note(&format!(
            "{label}: mIoU {:.2} %, {:.0} s; left {}",
            finished.classes.miou_percent,
            finished.wall_s,
            clock(left)
        ));
        planned.finished = Some(finished);
    }
    progress.finish();

    let finished: Vec<FinishedRun> = plan.into_iter().filter_map(|p| p.finished).collect();
    let of_row = |name: &str| -> Vec<FinishedRun> {
        finished.iter().filter(|r| r.key.row == name).cloned().collect()
    };
    let neither = of_row(&variant(AblationRow::Neither).0.name);
    let mut warnings: Vec<String> = Vec::new();
    for warning in finished.iter().flat_map(|r| &r.warnings) {
        if !warnings.contains(warning) {
            warnings.push(warning.clone());
        }
    }
    let first = finished.first();
    let ablation = Ablation {
        program: key.program,
        sequence: results::sequence_record(&info, &record),
        preset: effective.preset.clone(),
        config_hash: configuration::hash(&effective.config)?,
        engine: engine_record,
        seeds,
        render_every: args.render_every,
        input_labels: first.and_then(|r| r.input_labels.clone()),
        rows: rows
            .iter()
            .map(|&row| {
                let variant = variant(row).0;
                let runs = of_row(&variant.name);
                Row::new(variant, runs, &neither)
            })
            .collect(),
        protocols: protocols(first, args),
        warnings,
    };
    let (json, markdown) = (ablation.to_json()?, ablation.to_markdown());
    replace_file(&out.join("ablation.json"), json.as_bytes())?;
    replace_file(&out.join("ablation.md"), markdown.as_bytes())?;
    screen.result(&markdown, &json);
    screen.note(&format!("written to {}", out.display()));
    Ok(())
}

/// Refuses what cannot be scored, before anything slow.
fn check_labels(
    args: &AblateArgs,
    sequence: &mut dyn Sequence,
    truth: &mut ClassTruth,
) -> Result<()> {
    let info = sequence.info().clone();
    let name = args.dataset.display();
    let labels = args.selection.segmentation.segmenter.as_ref().unwrap_or(&args.selection.labels);
    if info.classes.is_empty() {
        usage!(
            "{name}: ablate needs labels: found none (--labels {labels}), expected a recording \
             with label images, or --labels DIR"
        );
    }
    if let Some(reason) = truth.reason() {
        usage!(
            "{name}: ablate needs true labels: found none ({reason}), expected --truth-labels \
             dataset or DIR"
        );
    }
    let all: Vec<usize> = (0..info.frames).collect();
    let mut input = ClassTruth::of_input(labels, &info);
    if !input.has_labels(sequence, &all)? {
        bail!(
            "{name}: ablate needs labels: found no pixel with a class in the images of --labels \
             {labels}"
        );
    }
    let scored: Vec<usize> = (0..info.frames).step_by(args.render_every).collect();
    if !truth.has_labels(sequence, &scored)? {
        bail!(
            "{name}: ablate needs true labels: found no pixel with a class in the scored frames \
             of --truth-labels {} (every {}th)",
            truth.name,
            args.render_every
        );
    }
    Ok(())
}

/// The output folder must be absent, empty, or of an earlier ablation.
fn check_folder(out: &Path) -> Result<()> {
    if out.exists() && !out.is_dir() {
        bail!("{}: the output folder: found a file, expected a folder or nothing", out.display());
    }
    if !out.is_dir() || out.join("runs").is_dir() || out.join("ablation.json").is_file() {
        return Ok(());
    }
    let unreadable = || format!("{}: the output folder cannot be read", out.display());
    if let Some(entry) = fs::read_dir(out).with_context(unreadable)?.next() {
        let name = entry.with_context(unreadable)?.file_name();
        bail!(
            "{}: the output folder: found files that no ablation wrote (such as {}), expected an \
             empty folder or one of an earlier ablation. Choose another with --out.",
            out.display(),
            name.display()
        );
    }
    Ok(())
}

/// The configuration of a run, and what an earlier start left of it.
fn planned(
    out: &Path,
    key: &RunKey,
    config: &Config,
    row: AblationRow,
    seed: u32,
) -> Result<Planned> {
    let (row, file) = variant(row);
    let mut config = config.clone();
    config.seed = seed;
    config.fusion.enabled = row.fusion;
    // Without fusion there is no local module to leave out; the hash must not depend on it.
    config.fusion.local = row.local || !row.fusion;
    config.suppressor.enabled = row.suppressor;
    config.semantics.head = row.head;
    if !row.suppressor {
        // There are no anchors to infer from.
        config.suppressor.inference = Inference::Head;
    }
    let config_hash = configuration::hash(&config)?;
    let key = RunKey { row: row.name, seed, config_hash, ..key.clone() };
    let path = out.join("runs").join(format!("{file}-{seed}.json"));
    let finished = if path.exists() { Some(read_run(&path, &key)?) } else { None };
    Ok(Planned { config, key, path, finished })
}

/// A kept run, which must be of the same configuration, recording and engine.
fn read_run(path: &Path, key: &RunKey) -> Result<FinishedRun> {
    let name = path.display();
    let text = fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    let advice = "Remove it to have it computed again, or choose another folder with --out.";
    let run: FinishedRun = serde_json::from_str(&text)
        .with_context(|| format!("{name}: found no finished run of an ablation. {advice}"))?;
    let (found, expected) = (serde_json::to_value(&run.key)?, serde_json::to_value(key)?);
    if let (Some(found), Some(expected)) = (found.as_object(), expected.as_object()) {
        // The hash says least to people, so it is named last.
        let (hashes, rest): (Vec<_>, Vec<_>) = expected.iter().partition(|e| e.0 == "config_hash");
        for (field, expected) in rest.into_iter().chain(hashes) {
            let found = found.get(field).unwrap_or(&serde_json::Value::Null);
            if found != expected {
                bail!(
                    "{name}: this finished run is of another ablation: {field}: found {found}, \
                     expected {expected}. {advice}"
                );
            }
        }
    }
    Ok(run)
}

/// One run, from the first frame to the scores.
fn run_one(
    planned: &Planned,
    started: StartedEngine,
    sequence: &mut dyn Sequence,
    class_truth: ClassTruth,
    progress: &mut Progress,
) -> Result<(FinishedRun, ClassTruth)> {
    let start = Instant::now();
    let info = sequence.info().clone();
    let mut run = block_on(Run::new(started.engine, planned.config.clone(), &info))
        .context("the map cannot be set up")?;
    let mut terminal = Terminal::new(progress, sequence);
    steps::take_all(&mut run, sequence, &planned.key.dataset, None, &mut terminal)?;
    let (mut slam, Log { frames, finish_s, .. }) = run.into_parts();
    let estimates = slam.trajectory();
    let truth: Vec<_> = estimates.iter().map(|e| sequence.truth(e.frame)).collect();

    let mut scores = ViewScores::new(&info, class_truth, slam.color_registration());
    let views = estimates.iter().step_by(planned.key.render_every);
    for (i, estimate) in views.enumerate() {
        let (frame, mut view) = views::render_frame(&mut slam, sequence, estimate)?;
        views::score_view(&mut scores, &frame, &mut view)?;
        progress.set((info.frames + i) as u64 + 1, || "scoring views".to_owned());
    }
    let mut metrics = Metrics::default();
    scores.report(pictures::unlabelled_id(&info.classes), &mut metrics);
    let Some(semantics) = metrics.semantics.take() else {
        bail!("found no true labels in the frames that were scored");
    };
    let ate = evaluation::trajectory(&estimates, &truth, |_| true).ok().map(|s| s.report);
    let mut protocols = BTreeMap::new();
    protocols.insert("classes".to_owned(), semantics.report.protocol.clone());
    if let Some(boundary) = &semantics.report.boundary {
        protocols.insert("boundary".to_owned(), boundary.protocol.clone());
    }
    if let Some(ate) = &ate {
        protocols.insert("ATE".to_owned(), ate.protocol.clone());
    }
    let m = &planned.config.mapping;
    let mut warnings = sequence.warnings();
    warnings.append(&mut metrics.warnings);
    let finished = FinishedRun {
        key: planned.key.clone(),
        classes: ClassScores::of(&semantics),
        input_labels: metrics.input_labels.as_ref().map(ClassScores::of),
        ate_rmse_cm: ate.map(|a| a.aligned_cm.rmse),
        depth_l1_cm: metrics.depth.map(|d| d.l1_cm),
        psnr_db: metrics.color.map(|c| c.mean_of_psnr_db),
        lost_frames: estimates.iter().filter(|e| e.status == TrackingStatus::Lost).count(),
        mapping_iteration_s: iteration_s(
            frames.iter().map(|f| f.mapping_s),
            m.first_iterations,
            m.iterations,
        ),
        finish_s,
        wall_s: start.elapsed().as_secs_f64(),
        parameters: block_on(slam.parameters())?,
        small_classes: (semantics.report.small_classes.len(), semantics.small_share_percent),
        small_class_names: semantics.small_class_names(),
        warnings,
        protocols,
    };
    Ok((finished, scores.into_truth()))
}

/// Mean time of an iteration over the mapping calls (0 for none) but the first: that one compiles
/// pipelines on some engines, and counts only when it is alone.
fn iteration_s(
    mapping_s: impl Iterator<Item = f64>,
    first_iterations: u32,
    iterations: u32,
) -> Option<f64> {
    let calls: Vec<f64> = mapping_s.filter(|s| *s > 0.0).collect();
    let (s, n) = match calls.as_slice() {
        [] => return None,
        [only] => (*only, f64::from(first_iterations)),
        [_, rest @ ..] => (rest.iter().sum(), rest.len() as f64 * f64::from(iterations)),
    };
    (n > 0.0).then(|| s / n)
}

fn protocols(first: Option<&FinishedRun>, args: &AblateArgs) -> BTreeMap<String, String> {
    let mut all = first.map(|r| r.protocols.clone()).unwrap_or_default();
    let mut add = |what: &str, protocol: String| all.insert(what.to_owned(), protocol);
    add(
        "rows",
        "MTFF is `fusion.enabled`, its local module `fusion.local`, FRS `suppressor.enabled`, the \
         per-sample head (SNI-SLAM's, 32-256-256-256-C, logits composited) `semantics.head`; \
         everything else is the same, but classes come from the class head where there are no \
         anchors"
            .to_owned(),
    );
    add(
        "seeds",
        "mean ± sample standard deviation over the seeds; gains are differences of runs with the \
         same seed"
            .to_owned(),
    );
    add(
        "views",
        format!(
            "every {}th frame, rendered at the estimated pose without depth input",
            args.render_every
        ),
    );
    if let Some((n, share)) = first.map(|r| r.small_classes) {
        add(
            "small classes",
            format!("mIoU of the {n} classes with less than {share} % of the true pixels"),
        );
    }
    add(
        "time",
        "wall clock of the mapping calls but the first, training steps of the fusion included, \
         over their iterations; the last optimisation over all keyframes apart"
            .to_owned(),
    );
    add(
        "parameters",
        "numbers that decide a pixel's class: semantic planes, semantic decoder, class head, \
         fusion (used in training alone), anchors at their bound"
            .to_owned(),
    );
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_of_an_iteration_leaves_out_the_first_call() {
        let of = |s: &[f64]| iteration_s(s.iter().copied(), 100, 10);
        assert_eq!(of(&[50.0, 0.0, 1.0, 0.0, 3.0]), Some(0.2));
        assert_eq!((of(&[50.0, 0.0]), of(&[0.0])), (Some(0.5), None));
        assert_eq!(iteration_s([1.0, 1.0].into_iter(), 1, 0), None);
    }
}
