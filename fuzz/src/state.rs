//! A tiny run, and checkpoints of it that are not what they were.
use crate::bundle::{Bundle, File};
use mte_slam_core::{
    config::{Config, Tracker},
    engine::Engine,
    slam::{Checkpoint, Slam, SlamError},
};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};
use pollster::block_on;

const FRAMES: usize = 3;

/// A run of three frames, and its checkpoint.
pub struct Run {
    info: SequenceInfo,
    frames: Vec<Frame>,
    checkpoint: Checkpoint,
}

/// Returns the smallest map and the fewest steps that still go through everything.
fn config() -> Config {
    let mut config = Config { seed: 5, ..Config::default() };
    config.tracking.tracker = Tracker::Align;
    config.tracking.align_pixels = 64;
    config.field.surface_coarse_m = 0.96;
    config.field.surface_fine_m = 0.48;
    config.field.geometry_coarse_m = 0.96;
    config.field.geometry_fine_m = 0.48;
    (config.mapping.every, config.mapping.rays, config.mapping.window) = (2, 64, 2);
    (config.mapping.first_iterations, config.mapping.iterations) = (4, 2);
    (config.sampling.stratified, config.sampling.surface) = (8, 4);
    config.keyframes.budget_mib = 1;
    config
}

/// The entry that a hash must equal is told by the error, so a changed state can be given its own.
const HASHES: [&str; 2] = ["configuration", "data"];

impl Default for Run {
    fn default() -> Self {
        Self::new()
    }
}

impl Run {
    pub fn new() -> Run {
        let options =
            SyntheticOptions { width: 32, height: 24, frames: FRAMES, ..Default::default() };
        let mut room = SyntheticSequence::new(options);
        let frames: Vec<Frame> = (0..FRAMES).map(|i| room.frame(i).expect("a frame")).collect();
        let info = room.info().clone();
        let mut slam = block_on(Slam::new(Engine::cpu(), config(), &info)).expect("a run");
        for frame in &frames {
            block_on(slam.process(frame)).expect("a processed frame");
        }
        let checkpoint = block_on(slam.checkpoint()).expect("a checkpoint");
        Run { info, frames, checkpoint }
    }

    /// Returns the state, and the smaller tensors, as the start of all inputs.
    pub fn bundle(&self) -> Bundle {
        let state =
            File { name: b"state".into(), bytes: self.checkpoint.metadata["state"].clone().into() };
        let small = self.checkpoint.tensors.iter().filter(|t| t.bytes.len() <= 512);
        let tensors = small.map(|t| File { name: t.name.clone().into(), bytes: t.bytes.clone() });
        Bundle { options: [0; 4], files: [state].into_iter().chain(tensors).collect() }
    }

    /// Returns the file of the checkpoint without its planes, which would make it large.
    pub fn small_file(&self) -> Vec<u8> {
        let mut small = self.checkpoint.clone();
        small.tensors.retain(|t| t.bytes.len() <= 512);
        small.to_bytes()
    }

    fn changed(&self, bundle: &Bundle) -> Checkpoint {
        let mut checkpoint = self.checkpoint.clone();
        for file in &bundle.files {
            let Ok(name) = std::str::from_utf8(&file.name) else { continue };
            if name == "state" {
                let text = String::from_utf8_lossy(&file.bytes).into_owned();
                checkpoint.metadata.insert(name.into(), text);
            }
            for tensor in checkpoint.tensors.iter_mut().filter(|t| t.name == name) {
                let width = tensor.dtype.size();
                let n = file.bytes.len() / width;
                tensor.bytes = file.bytes[..n * width].to_vec();
                // Whatever else it was, its first dimension says how many there are.
                let row: usize = tensor.shape.iter().skip(1).product::<usize>().max(1);
                if let Some(first) = tensor.shape.first_mut() {
                    *first = n / row;
                }
            }
        }
        checkpoint
    }

    /// Shows and resumes the run that the input makes of the checkpoint.
    pub fn go_on(&self, bundle: &Bundle) {
        let mut checkpoint = self.changed(bundle);
        let mut shown = block_on(Slam::restore(Engine::cpu(), &checkpoint));
        for _ in HASHES {
            if let Err(SlamError::Checkpoint { field, expected, .. }) = &shown
                && HASHES.contains(&field.as_str())
            {
                checkpoint.metadata.insert(field.clone(), expected.clone());
                shown = block_on(Slam::restore(Engine::cpu(), &checkpoint));
            }
        }
        if let Ok(mut shown) = shown {
            assert!(block_on(shown.checkpoint()).is_err(), "only shown");
        }
        // The configuration is the state's own, where it has one.
        let state: Option<serde_json::Value> =
            checkpoint.metadata.get("state").and_then(|s| serde_json::from_str(s).ok());
        let config = state.and_then(|s| serde_json::from_value(s.get("config")?.clone()).ok());
        let config: Config = config.unwrap_or_else(self::config);
        let resuming = Slam::resume(Engine::cpu(), config, &self.info, &checkpoint);
        let Ok(mut resuming) = block_on(resuming) else { return };
        for index in resuming.missing().collect::<Vec<_>>() {
            let Some(frame) = self.frames.get(index) else { return };
            if resuming.add(frame).is_err() {
                return;
            }
        }
        if let Ok(mut slam) = resuming.finish() {
            let _ = block_on(slam.checkpoint()).expect("a run that goes on can be saved");
        }
    }
}
