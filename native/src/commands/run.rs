//! `mte-slam run`.
use crate::{
    args::RunArgs,
    class_truth::ClassTruth,
    configuration,
    evaluation::MeshTruth,
    input,
    pipeline::{self, Job},
    record::RunRecord,
    screen::Screen,
};
use anyhow::Result;
use std::path::{Path, PathBuf};

/// Run SLAM on a recording.
pub fn run(args: &RunArgs, screen: Screen) -> Result<()> {
    // Everything that can be wrong with the command line comes before anything slow.
    let named = args.config.preset.is_some();
    let early = configuration::effective(&args.config, "replica")?;
    let sequence = input::open(&args.dataset, &args.selection, screen)?;
    let info = sequence.info();
    let default_preset = preset_of_layout(info.layout);
    let effective = if named || default_preset == early.preset {
        early
    } else {
        configuration::effective(&args.config, default_preset)?
    };
    let class_truth = if info.classes.is_empty() {
        ClassTruth::none("there are no labels", info)
    } else {
        input::open_truth(&args.dataset, &args.selection, info)?
    };
    let record = RunRecord {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        preset: effective.preset.clone(),
        dataset: args.dataset.display().to_string(),
        layout: info.layout.to_owned(),
        start: args.selection.start,
        stride: args.selection.stride,
        frames: info.frames,
        scale: args.selection.scale,
        labels: args.selection.labels.clone(),
        truth_labels: class_truth.name.clone(),
        classes: args.selection.classes.classes.clone(),
        unlabelled: args.selection.classes.unlabelled,
        ..RunRecord::default()
    };
    let default_out =
        Path::new("out").join(format!("{}-{}", folder_name(&args.dataset), effective.preset));
    let truth_mesh = MeshTruth::find(args.mesh.as_deref(), &args.dataset)?;
    let job = Job {
        sequence,
        record,
        effective,
        engine: &args.engine,
        output: &args.output,
        default_out,
        class_truth,
        truth_mesh,
    };
    pipeline::run(job, screen)
}

/// The preset that suits a layout.
fn preset_of_layout(layout: &str) -> &'static str {
    match layout {
        // 7-Scenes is what ScanNet is: a real room at 30 Hz by a structured-light sensor.
        "7scenes" => "scannet",
        "tum" => "tum",
        _ => "replica",
    }
}

/// The folder's own name, also of `.` and `data/room/`.
fn folder_name(path: &Path) -> String {
    let whole: PathBuf = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    whole.file_name().map_or("recording".to_owned(), |n| n.to_string_lossy().into_owned())
}
