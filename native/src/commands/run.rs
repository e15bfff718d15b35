//! `mte-slam run`.
use crate::{
    args::RunArgs,
    evaluation::MeshTruth,
    input::{self, Prepared},
    pipeline::{self, Job},
    screen::Screen,
};
use anyhow::Result;
use std::path::Path;

/// Run SLAM on a recording.
pub fn run(args: &RunArgs, screen: Screen) -> Result<()> {
    let Prepared { sequence, effective, class_truth, record } =
        input::prepare(&args.dataset, &args.selection, &args.config, screen)?;
    let name = input::folder_name(&args.dataset);
    let default_out = Path::new("out").join(format!("{name}-{}", effective.preset));
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
