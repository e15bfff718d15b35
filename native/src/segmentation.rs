//! Recordings whose labels a network makes, or whose classes are merged.
use crate::{args::SegmenterArgs, errors::usage, memory, screen::Screen};
use anyhow::Result;
use mte_slam_segment::{MAX_MODEL_BYTES, ModelFiles, Segmented, Segmenter, SegmenterOptions};
use mte_slam_types::{groups::Groups, sequence::Sequence};
use std::path::Path;

/// Name of the network that the program carries.
const BUILT_IN: &str = "built-in";

/// The groups that `--groups` names.
pub fn groups(args: &SegmenterArgs) -> Result<Option<Groups>> {
    let Some(name) = &args.groups else { return Ok(None) };
    if name == "indoor" {
        return Ok(Some(Groups::indoor()));
    }
    match std::fs::read_to_string(name) {
        Ok(text) => Ok(Some(Groups::parse(name, &text)?)),
        Err(e) => usage!("--groups {name}: {e}; expected indoor, or a readable file"),
    }
}

/// The network that `--segmenter` names.
pub fn open(args: &SegmenterArgs, screen: Screen) -> Result<Option<Segmenter>> {
    let Some(name) = &args.segmenter else {
        if args.segment_size.is_some() || args.segment_every.is_some() || args.min_confidence > 0.0
        {
            usage!("--segment-size, --segment-every and --min-confidence need --segmenter MODEL");
        }
        return Ok(None);
    };
    let files = if name == BUILT_IN {
        ModelFiles::built_in()
    } else {
        // Loading takes about three times the file.
        let free = memory::available_bytes().map_or(MAX_MODEL_BYTES, |bytes| bytes / 3);
        ModelFiles::open(Path::new(name), free.min(MAX_MODEL_BYTES))?
    };
    let options = SegmenterOptions {
        size: args.segment_size,
        min_confidence: args.min_confidence,
        groups: groups(args)?,
        turn: args.turn,
        threads: args.segment_threads,
    };
    let segmenter = Segmenter::load(files, &options)?;
    screen.note(&format!("{name}: {}", segmenter.summary()));
    for warning in segmenter.warnings() {
        screen.note(&format!("note: {warning}"));
    }
    Ok(Some(segmenter))
}

/// A recording labelled as the flags say, every `every`-th frame unless they say otherwise.
pub fn labelled(
    sequence: Box<dyn Sequence>,
    args: &SegmenterArgs,
    every: usize,
    screen: Screen,
) -> Result<Box<dyn Sequence>> {
    match open(args, screen)? {
        Some(segmenter) => {
            let every = args.segment_every.unwrap_or(every);
            Ok(Box::new(Segmented::new(sequence, segmenter, every)))
        }
        None => grouped(sequence, args),
    }
}

/// A recording with its own labels, in groups if the flags say so.
pub fn grouped(sequence: Box<dyn Sequence>, args: &SegmenterArgs) -> Result<Box<dyn Sequence>> {
    Ok(match groups(args)? {
        Some(groups) => Box::new(mte_slam_types::groups::Grouped::new(sequence, &groups)),
        None => sequence,
    })
}
