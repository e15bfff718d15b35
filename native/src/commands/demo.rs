//! `mte-slam demo`.
use crate::{
    args::DemoArgs,
    class_truth::ClassTruth,
    configuration, input,
    pipeline::{self, RunSetup},
    record::{RunRecord, SegmenterRecord},
    screen::Screen,
    segmentation,
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
        segmenter: SegmenterRecord::of(&args.segmentation),
        groups: args.segmentation.groups.clone(),
        ..RunRecord::default()
    };
    let default_out = Path::new("out").join(format!("demo-{}", effective.preset));
    let truth_mesh = if args.output.no_mesh {
        Err(String::new())
    } else {
        Ok(input::true_mesh(sequence.ground_truth_mesh()))
    };
    let every = effective.config.mapping.every as usize;
    let sequence = segmentation::labelled(Box::new(sequence), &args.segmentation, every, screen)?;
    let truth = Box::new(input::built_in(args.frames, args.width));
    let class_truth = match args.segmentation.segmenter {
        None => ClassTruth::of_input("dataset", sequence.info()),
        Some(_) => {
            let truth = segmentation::grouped(truth, &args.segmentation)?;
            ClassTruth::of_sequence("dataset", truth, sequence.info())?
        }
    };
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
