//! The loop.
use crate::{
    host::{Event, Host, Paced},
    input::Input,
    log::{FrameLog, Log},
};
use mte_slam_core::{
    config::Config,
    engine::Engine,
    slam::{FrameReport, Slam, SlamError},
};
use mte_slam_types::frame::{Frame, SequenceInfo};

/// Why a run stopped.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RunError<E> {
    /// A frame could not be had. The run is as it was: the next step asks for it again.
    #[error("frame {index}: {error}")]
    Input {
        /// `Frame::index`.
        index: usize,
        /// Why.
        error: E,
    },
    /// A frame could not be processed. The run is not usable any more.
    #[error("frame {number} (index {index}): {error}")]
    Frame {
        /// `Frame::index`.
        index: usize,
        /// `Frame::number`.
        number: u64,
        /// Why.
        error: SlamError,
    },
    /// The last optimisation failed. The run is not usable any more.
    #[error("the last optimisation failed: {0}")]
    Finish(SlamError),
    /// The run cannot go on from the saved state.
    #[error("{0}")]
    Resume(SlamError),
}

impl<E> RunError<E> {
    /// What the core says, unless it was the input that failed.
    pub fn slam(&self) -> Option<&SlamError> {
        match self {
            RunError::Input { .. } => None,
            RunError::Frame { error, .. } => Some(error),
            RunError::Finish(error) | RunError::Resume(error) => Some(error),
        }
    }
}

/// What a step did.
#[derive(Clone, Debug)]
pub enum Step {
    /// Processed a frame.
    Frame(FrameReport),
    /// Did a part of the last optimisation.
    Part {
        /// Whether there is more of it.
        more: bool,
    },
    /// Nothing: the run is complete.
    Done,
}

/// A run: a map, the frames that made it, and what is to be done next.
pub struct Run {
    pub(crate) slam: Slam,
    pub(crate) log: Log,
    /// When the first step began.
    pub(crate) begun_s: Option<f64>,
    /// Whether the last optimisation is done.
    pub(crate) finished: bool,
    /// False once the core has failed half-way: such a state must not be saved.
    pub(crate) settled: bool,
    /// Whether the input has come to its end.
    ended: bool,
}

impl Run {
    /// A run that has seen nothing.
    ///
    /// # Errors
    /// [`SlamError::Config`].
    pub async fn new(
        engine: Engine,
        config: Config,
        info: &SequenceInfo,
    ) -> Result<Run, SlamError> {
        let slam = Slam::new(engine, config, info).await?;
        Ok(Run::with(slam, Log::default(), false))
    }

    pub(crate) fn with(slam: Slam, log: Log, finished: bool) -> Run {
        Run { slam, log, begun_s: None, finished, settled: true, ended: false }
    }

    /// Processes the next frame or, after the last one, does a part of the last optimisation.
    /// Between steps the run can be saved.
    ///
    /// # Errors
    /// [`RunError`] says what failed and whether the run can go on.
    pub async fn step<I: Input + ?Sized>(
        &mut self,
        input: &mut I,
        host: &mut dyn Host,
    ) -> Result<Step, RunError<I::Error>> {
        self.begun_s.get_or_insert(host.now_s());
        if !self.ended {
            let index = self.next_frame();
            let frame = input.read_frame(index, host).await;
            match frame.map_err(|error| RunError::Input { index, error })? {
                Some(frame) => {
                    let number = frame.number;
                    let report = self.process(frame, host).await;
                    let failed = |error| RunError::Frame { index, number, error };
                    return report.map(Step::Frame).map_err(failed);
                }
                None => self.ended = true,
            }
        }
        self.finish_step(host).await.map_err(RunError::Finish)
    }

    /// Takes steps until the run is complete.
    ///
    /// # Errors
    /// As [`Run::step`].
    pub async fn to_end<I: Input + ?Sized>(
        &mut self,
        input: &mut I,
        host: &mut dyn Host,
    ) -> Result<(), RunError<I::Error>> {
        while !matches!(self.step(input, host).await?, Step::Done) {}
        Ok(())
    }

    /// Ends the run with the frames it has: no more are taken, and the last optimisation is done
    /// to its end.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn finish(&mut self, host: &mut dyn Host) -> Result<(), SlamError> {
        self.ended = true;
        while !matches!(self.finish_step(host).await?, Step::Done) {}
        Ok(())
    }

    // Not generic, so that it is compiled once.
    async fn process(
        &mut self,
        frame: Frame,
        host: &mut dyn Host,
    ) -> Result<FrameReport, SlamError> {
        host.event(Event::Frame { frame: &frame, info: self.slam.info() });
        if host.has_event_loop() {
            host.turn().await;
        }
        self.settled = false;
        self.finished = false;
        let begin_s = host.now_s();
        let report = self.slam.process_with(&frame, &mut Paced(host)).await?;
        self.log.frames.push(FrameLog {
            frame: frame.index,
            status: report.status,
            tracking_s: report.tracking_s,
            // Without mapping the clock still counts some nanoseconds.
            mapping_s: if report.losses.is_some() { report.mapping_s } else { 0.0 },
            total_s: host.now_s() - begin_s,
            losses: report.losses,
            keyframes: self.slam.keyframes().len(),
            anchors: self.slam.anchor_history().last().map(|(_, counts)| counts.alive),
        });
        self.settled = true;
        if let Some(log) = self.log.frames.last() {
            host.event(Event::Processed { report: &report, log, slam: &self.slam });
        }
        Ok(report)
    }

    async fn finish_step(&mut self, host: &mut dyn Host) -> Result<Step, SlamError> {
        if self.finished {
            return Ok(Step::Done);
        }
        self.settled = false;
        let begin_s = host.now_s();
        let before = self.slam.finished_iterations();
        let more = self.slam.finish_step_with(&mut Paced(host)).await?;
        self.settled = true;
        self.finished = !more;
        let iterations = self.slam.finished_iterations();
        if iterations == before {
            return Ok(Step::Done);
        }
        self.log.finish_s += host.now_s() - begin_s;
        host.event(Event::Finishing { iterations, more });
        Ok(Step::Part { more })
    }

    /// Index of the frame that comes next: the number of those processed.
    pub fn next_frame(&self) -> usize {
        self.slam.next_frame()
    }

    /// Whether the last optimisation is done. Another frame would make it necessary again.
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// What is kept of the frames so far.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// Adds a sentence to [`Log::notes`].
    pub fn note(&mut self, text: String) {
        self.log.notes.push(text);
    }

    /// Time since the first step began, that of earlier starts included \[s\].
    pub fn elapsed_s(&self, host: &dyn Host) -> f64 {
        self.log.earlier_s + self.begun_s.map_or(0.0, |begun| host.now_s() - begun)
    }

    /// The map and the poses so far.
    pub fn slam(&self) -> &Slam {
        &self.slam
    }

    /// The map, to be rendered, meshed or set up to be shown otherwise.
    pub fn slam_mut(&mut self) -> &mut Slam {
        &mut self.slam
    }

    /// Ends the run: its map, and what it kept of its frames.
    pub fn into_parts(self) -> (Slam, Log) {
        (self.slam, self.log)
    }
}

#[cfg(test)]
mod tests;
