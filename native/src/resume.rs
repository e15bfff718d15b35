//! Checkpoints of a run while it runs, and its continuation from the last one.
//!
//! They live in `OUT/.resume`, beside the staging folder that a killed run loses: `command.json`
//! (what was typed, and where) and `checkpoint.safetensors`, which a newer one replaces as a whole.
//! A finished run removes the folder after its results are in place.
use crate::{
    errors::usage,
    host::Terminal,
    invocation::Invocation,
    output::{checkpoint, folder::replace_file, metrics::SavingFigures},
    record::{self, RunRecord},
};
use anyhow::{Context, Result, bail};
use mte_slam_core::{
    config::Config,
    engine::{Engine, EngineError},
    slam::SlamError,
};
use mte_slam_run::{Run, RunError, SavedRun};
use mte_slam_types::{hash::Hasher, sequence::Sequence};
use pollster::block_on;
use serde::{Deserialize, Serialize};
use std::{
    fmt, fs,
    path::{Path, PathBuf},
    time::Instant,
};

/// Where checkpoints lie in an output folder.
pub use mte_slam_report::files::RESUME_FOLDER as FOLDER;

const CHECKPOINT: &str = "checkpoint.safetensors";
/// The command line that started the run.
pub const COMMAND: &str = "command.json";
/// Parts of the last optimisation (of 20 iterations) between checkpoints, at most.
const PARTS: usize = 10;

/// What this program keeps in a checkpoint.
#[derive(Serialize, Deserialize)]
struct Kept {
    record: RunRecord,
    /// Of all time stamps and true poses.
    sequence_hash: String,
}

/// An interrupted run.
pub struct Saved {
    path: PathBuf,
    run: SavedRun<Kept>,
}

/// The interrupted run of an output folder, if it got as far as a checkpoint.
pub fn find(out: &Path) -> Result<Option<Saved>> {
    let path = out.join(FOLDER).join(CHECKPOINT);
    if !path.is_file() {
        return Ok(None);
    }
    let advice = || no_resumption(&path);
    let run =
        SavedRun::new(checkpoint::read_file(&path).with_context(advice)?).with_context(advice)?;
    Ok(Some(Saved { path: path.clone(), run }))
}

fn no_resumption(path: &Path) -> String {
    format!("{}: the run cannot be resumed; without --resume it starts anew", path.display())
}

/// Whether the folder holds the finished run that was asked for. One of another kind is an error.
pub fn is_finished(out: &Path, record: &RunRecord, config_hash: &str) -> Result<bool> {
    if out.join(FOLDER).exists() || !out.join("metrics.json").is_file() {
        return Ok(false);
    }
    let Some(found) = record::read_run(out)? else { return Ok(false) };
    let now = RunRecord { config_hash: config_hash.to_owned(), ..record.clone() };
    if let Some((field, found, expected)) = difference(&found, &now, true) {
        usage!(
            "--resume: {} holds a finished run of another kind: {field}: found {found}, expected \
             {expected}. Without --resume it is replaced; --out names another folder.",
            out.display()
        );
    }
    Ok(true)
}

/// The first entry by which two runs differ: name, of `a`, of `b`. Paths are left to the hashes of
/// what is there.
fn difference(
    a: &RunRecord,
    b: &RunRecord,
    config: bool,
) -> Option<(&'static str, String, String)> {
    let entries = |r: &RunRecord| {
        [
            ("version", r.version.clone()),
            ("layout", r.layout.clone()),
            ("start", r.start.to_string()),
            ("stride", r.stride.to_string()),
            ("frames", r.frames.to_string()),
            ("scale", r.scale.to_string()),
            ("camera", format!("{:?}", r.camera)),
            ("depth scale", format!("{:?}", r.depth_scale)),
            ("axes", format!("{:?}", r.axes)),
            ("depth limit", format!("{:?}", r.max_depth)),
            ("order", format!("{:?}", r.order)),
            ("feature maps", r.features.is_some().to_string()),
            ("unlabelled", format!("{:?}", r.unlabelled)),
            (
                "segmenter",
                format!(
                    "{:?}",
                    r.segmenter.as_ref().map(|s| (s.size, s.every, &s.min_confidence, &s.turn))
                ),
            ),
            ("groups", format!("{:?}", r.groups)),
            ("preset", r.preset.clone()),
            ("configuration", if config { r.config_hash.clone() } else { String::new() }),
        ]
    };
    let pairs = entries(a).into_iter().zip(entries(b));
    { pairs }.find(|(a, b)| a.1 != b.1).map(|(a, b)| (a.0, a.1, b.1))
}

fn sequence_hash(sequence: &dyn Sequence) -> String {
    let mut h = Hasher::default();
    for i in 0..sequence.info().frames {
        h.word(sequence.time_s(i).to_bits());
        let truth = sequence.truth(i);
        h.word(u64::from(truth.is_some()));
        truth.iter().flat_map(|p| p.to_row_major()).for_each(|x| h.word(x.to_bits()));
    }
    format!("{:016x}", h.finish())
}

impl Saved {
    /// Frames in the checkpoint.
    pub fn frames(&self) -> usize {
        self.run.frames()
    }

    /// The run as it was when it was saved.
    pub fn resume(
        self,
        engine: Engine,
        config: &Config,
        sequence: &mut dyn Sequence,
        record: &RunRecord,
    ) -> Result<Run> {
        let Saved { path, run: saved } = self;
        let advice = || no_resumption(&path);
        let before = saved.host.record.clone();
        if let Some((field, found, expected)) = difference(&before, record, false) {
            usage!("{}: {field}: found a run with {found}, expected {expected}", advice());
        }
        if saved.host.sequence_hash != sequence_hash(sequence) {
            bail!(
                "{}: data: found a run with other time stamps or true poses than {}",
                advice(),
                record.dataset
            );
        }
        let info = sequence.info().clone();
        let mut quiet = ();
        let resumed = saved.resume(engine, config.clone(), &info, sequence, &mut quiet);
        let mut run = match block_on(resumed) {
            Ok(run) => run,
            Err(RunError::Input { error, .. }) => {
                return Err(error).with_context(|| record.dataset.clone());
            }
            Err(RunError::Resume(error)) => return Err(error).with_context(advice),
            Err(error) => return Err(error).with_context(advice),
        };
        // The reader counts what it meets in label images, for its warnings.
        if !info.classes.is_empty() {
            for index in 0..run.next_frame() {
                sequence.labels(index).with_context(|| record.dataset.clone())?;
            }
        }
        let engine = |r: &RunRecord| (r.engine.clone(), r.adapter.clone(), r.backend.clone());
        if engine(&before) != engine(record) {
            run.note(format!(
                "resumed after frame {} on another engine ({} {} instead of {} {}): rounding \
                 differs from an uninterrupted run",
                run.next_frame(),
                record.engine,
                record.adapter,
                before.engine,
                before.adapter
            ));
        }
        Ok(run)
    }
}

/// Writes checkpoints.
pub struct Saver {
    out: PathBuf,
    every: usize,
    kept: Kept,
    /// Whether the run is under way: what fails before that changes nothing.
    begun: bool,
    /// Frames that the last checkpoint holds.
    saved: Option<usize>,
    seconds: f64,
    figures: SavingFigures,
}

impl Saver {
    /// For a run into `out`. `resumed`: the frames of the checkpoint that it continues.
    pub fn new(
        out: &Path,
        every: usize,
        record: &RunRecord,
        sequence: &dyn Sequence,
        resumed: Option<usize>,
    ) -> Saver {
        Saver {
            out: out.to_owned(),
            every,
            kept: Kept { record: record.clone(), sequence_hash: sequence_hash(sequence) },
            begun: false,
            saved: resumed,
            seconds: 0.0,
            figures: SavingFigures::default(),
        }
    }

    /// Notes how the run was started. What an earlier run has left to be resumed is removed, unless
    /// this is its continuation. Returns whether there was something.
    pub fn begin(&mut self, invocation: &Invocation) -> Result<bool> {
        self.begun = true;
        let stale = self.saved.is_none() && self.folder().join(CHECKPOINT).exists();
        if self.saved.is_none() {
            self.remove();
        }
        if self.every > 0 {
            let json = serde_json::to_string(invocation)?;
            replace_file(&self.folder().join(COMMAND), json.as_bytes())?;
        }
        Ok(stale)
    }

    fn folder(&self) -> PathBuf {
        self.out.join(FOLDER)
    }

    /// What checkpoints cost so far, if any was written.
    pub fn figures(&self) -> Option<SavingFigures> {
        (self.figures.count > 0).then_some(self.figures)
    }

    /// Writes a checkpoint when the number of frames says so, and after the last of `frames`.
    pub fn after_frame(&mut self, run: &mut Run, frames: usize, terminal: &Terminal) -> Result<()> {
        let done = run.next_frame();
        if self.every > 0 && (done.is_multiple_of(self.every) || done == frames) {
            self.save(run, terminal)?;
        }
        Ok(())
    }

    /// Writes a checkpoint when the number of parts of the last optimisation says so, and after
    /// the last part.
    pub fn after_part(
        &mut self,
        run: &mut Run,
        (parts, more): (usize, bool),
        terminal: &Terminal,
    ) -> Result<()> {
        if self.every > 0 && (!more || parts.is_multiple_of(self.every.min(PARTS))) {
            self.save(run, terminal)?;
        }
        Ok(())
    }

    /// Writes a checkpoint because the next frame cannot be read, unless this is so early that
    /// there is none at all.
    pub fn before_failure(&mut self, run: &mut Run, terminal: &Terminal) {
        if self.saved.is_some_and(|saved| saved < run.next_frame()) {
            // The error that brought us here is the one to report.
            let _ = self.save(run, terminal);
        }
    }

    fn save(&mut self, run: &mut Run, terminal: &Terminal) -> Result<()> {
        let begin = Instant::now();
        let checkpoint = block_on(run.checkpoint(&self.kept, terminal));
        let Some(checkpoint) = checkpoint.context("the run cannot be saved")? else {
            return Ok(());
        };
        let path = self.folder().join(CHECKPOINT);
        match checkpoint::write_file(&path, &checkpoint) {
            Ok(bytes) => {
                self.saved = Some(run.next_frame());
                self.figures.bytes = bytes;
                self.figures.count += 1;
                self.seconds += begin.elapsed().as_secs_f64();
                self.figures.mean_s = self.seconds / self.figures.count as f64;
            }
            // A full disk is no reason to lose the run; the checkpoint before is still there.
            Err(error) => terminal.note(&format!("note: {error:#}; the run continues without")),
        }
        Ok(())
    }

    /// Removes what was kept for a resumption: the results are in place.
    pub fn remove(&self) {
        // What cannot be removed now is replaced by the next run.
        let _ = fs::remove_dir_all(self.folder());
    }

    /// Adds to the error of a run where it can be resumed, and leaves nothing where it cannot.
    pub fn failed(&self, error: anyhow::Error) -> anyhow::Error {
        if !self.begun {
            return error;
        }
        if self.saved.is_none() {
            self.remove();
        }
        let device = is_device_failure(&error);
        if !device && self.saved.is_none() {
            return error;
        }
        error.context(Interrupted {
            device,
            frames: self.saved,
            every: self.every,
            out: self.out.clone(),
        })
    }
}

fn is_device_failure(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| match cause.downcast_ref::<SlamError>() {
        Some(SlamError::Engine(e)) => e.is_device_failure(),
        _ => cause.downcast_ref::<EngineError>().is_some_and(EngineError::is_device_failure),
    })
}

/// A run stopped half-way. Its cause is the error that this is the context of.
#[derive(Debug)]
pub struct Interrupted {
    /// Whether the device is the cause: a reset of the driver, or no memory left.
    pub device: bool,
    /// Frames in the last checkpoint, if there is one.
    pub frames: Option<usize>,
    every: usize,
    out: PathBuf,
}

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = if self.device { "the device failed" } else { "the run stopped" };
        let out = self.out.display();
        match (self.frames, self.every) {
            (Some(n), _) => write!(
                f,
                "{what}, saved after {n} frames in {out}/{FOLDER}/{CHECKPOINT}; `mte-slam run \
                 --resume {out}` goes on from there"
            ),
            (None, 0) => write!(f, "{what}, with no checkpoint (--checkpoint-every 0)"),
            (None, every) => write!(f, "{what} before the first checkpoint (after {every} frames)"),
        }
    }
}

impl std::error::Error for Interrupted {}

#[cfg(test)]
mod tests;
