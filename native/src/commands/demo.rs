//! `mte-slam demo`.
use crate::{
    args::DemoArgs,
    class_truth::ClassTruth,
    configuration, input,
    pipeline::{self, RunSetup},
    record::RunRecord,
    screen::Screen,
};
use anyhow::Result;
use mte_slam_types::sequence::Sequence;
use std::path::Path;

/// Runs SLAM on the built-in sequence.
pub fn run(args: &DemoArgs, screen: Screen) -> Result<()> {
    let effective = configuration::resolve(&args.config, "fast")?;
    let sequence = input::built_in(args.frames, args.width);
    let record = RunRecord {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        preset: effective.preset.clone(),
        dataset: "built-in".to_owned(),
        layout: sequence.info().layout.to_owned(),
        frames: sequence.info().frames,
        ..RunRecord::default()
    };
    let default_out = Path::new("out").join(format!("demo-{}", effective.preset));
    let truth_mesh = if args.output.no_mesh {
        Err(String::new())
    } else {
        Ok(input::true_mesh(sequence.ground_truth_mesh()))
    };
    let class_truth = ClassTruth::of_input("dataset", sequence.info());
    let setup = RunSetup {
        sequence: Box::new(sequence),
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
