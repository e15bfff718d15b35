//! `mte-slam run`.
use crate::{
    args::RunArgs,
    errors::usage,
    input::{self, Prepared},
    mesh_evaluation::MeshTruth,
    pipeline::{self, RunSetup},
    screen::Screen,
};
use anyhow::Result;
use std::path::Path;

/// Runs SLAM on a recording.
pub fn run(args: &RunArgs, screen: Screen) -> Result<()> {
    let Some(dataset) = &args.dataset else {
        usage!("found no DATASET, expected the folder of the recording, or --resume DIR alone");
    };
    let Prepared { sequence, effective, class_truth, record } =
        input::prepare(dataset, &args.selection, &args.config, screen)?;
    let name = input::folder_name(dataset);
    let default_out = Path::new("out").join(format!("{name}-{}", effective.preset));
    let truth_mesh = MeshTruth::find(args.mesh.as_deref(), dataset)?;
    let setup = RunSetup {
        sequence,
        record,
        effective,
        engine: &args.engine,
        output: &args.output,
        default_out,
        class_truth,
        truth_mesh,
    };
    pipeline::run(setup, screen)
}
