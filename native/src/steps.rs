//! The steps of a run, with checkpoints between them.
use crate::{host::Terminal, resume::Saver};
use anyhow::{Error, Result};
use mte_slam_run::{Run, RunError, Step};
use mte_slam_types::sequence::{Sequence, SequenceError};
use pollster::block_on;

/// Takes steps until the run is complete. `saver` writes checkpoints; `dataset` names the recording
/// in errors.
pub fn take_all(
    run: &mut Run,
    sequence: &mut dyn Sequence,
    dataset: &str,
    mut saver: Option<&mut Saver>,
    terminal: &mut Terminal,
) -> Result<()> {
    let frames = sequence.info().frames;
    let mut parts = 0;
    loop {
        match (block_on(run.step(sequence, terminal)), &mut saver) {
            (Ok(Step::Frame(_)), Some(saver)) => saver.after_frame(run, frames, terminal)?,
            (Ok(Step::Part { more }), Some(saver)) => {
                parts += 1;
                saver.after_part(run, (parts, more), terminal)?;
            }
            (Ok(Step::Frame(_) | Step::Part { .. }), None) => {}
            (Ok(Step::Done), _) => return Ok(()),
            (Err(error), saver) => {
                if let (RunError::Input { .. }, Some(saver)) = (&error, saver) {
                    saver.before_failure(run, terminal);
                }
                return Err(explained(error, dataset));
            }
        }
    }
}

/// The error with what it is about, its cause kept as a type.
fn explained(error: RunError<SequenceError>, dataset: &str) -> Error {
    match error {
        RunError::Input { error, .. } => Error::from(error).context(dataset.to_owned()),
        RunError::Frame { index, number, error } => {
            Error::from(error).context(format!("frame {number} (index {index})"))
        }
        RunError::Finish(error) => Error::from(error).context("the last optimisation failed"),
        RunError::Resume(error) => error.into(),
    }
}
