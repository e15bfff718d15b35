//! The state of a run: the core's checkpoint, with what the run and its host keep beside it in an
//! entry of its metadata.
use crate::{
    host::{Event, Host},
    input::Input,
    log::Log,
    run::{Run, RunError},
};
use mte_slam_core::{
    config::Config,
    engine::Engine,
    slam::{Checkpoint, Slam, SlamError},
};
use mte_slam_types::frame::SequenceInfo;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// Name of the metadata entry.
const ENTRY: &str = "run";

#[derive(Serialize)]
struct Written<'a, T> {
    log: &'a Log,
    elapsed_s: f64,
    finished: bool,
    host: &'a T,
}

#[derive(Deserialize)]
struct Read<T> {
    log: Log,
    elapsed_s: f64,
    finished: bool,
    host: T,
}

/// A run that was saved, with `T`, what its host keeps.
pub struct SavedRun<T> {
    checkpoint: Checkpoint,
    log: Log,
    finished: bool,
    /// The host's part.
    pub host: T,
}

fn wrong(field: &str, found: impl ToString, expected: impl ToString) -> SlamError {
    SlamError::Checkpoint {
        field: field.into(),
        found: found.to_string(),
        expected: expected.to_string(),
    }
}

impl<T> SavedRun<T> {
    /// Takes a checkpoint that [`Run::checkpoint`] made with the same kind of host.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] names the entry that is missing or cannot be read.
    pub fn new(mut checkpoint: Checkpoint) -> Result<SavedRun<T>, SlamError>
    where
        T: DeserializeOwned,
    {
        let Some(text) = checkpoint.metadata.remove(ENTRY) else {
            return Err(wrong(ENTRY, "nothing", "the state of a run"));
        };
        let read: Result<Read<T>, _> = serde_json::from_str(&text);
        let Read { mut log, elapsed_s, finished, host } =
            read.map_err(|e| wrong(ENTRY, e, "the state of a run of this version"))?;
        log.earlier_s = elapsed_s;
        Ok(SavedRun { checkpoint, log, finished, host })
    }

    /// Frames that were processed.
    pub fn frames(&self) -> usize {
        self.log.frames.len()
    }

    /// The run as it was when it was saved, on a new engine. The frames that the map and the
    /// odometry hold are asked of `input` again; they must be the same, bit for bit.
    ///
    /// # Errors
    /// [`RunError::Resume`] names what does not fit; [`RunError::Input`].
    pub async fn resume<I: Input + ?Sized>(
        self,
        engine: Engine,
        config: Config,
        info: &SequenceInfo,
        input: &mut I,
        host: &mut dyn Host,
    ) -> Result<Run, RunError<I::Error>> {
        let SavedRun { checkpoint, log, finished, .. } = self;
        let resuming = Slam::resume(engine, config, info, &checkpoint).await;
        let mut resuming = resuming.map_err(RunError::Resume)?;
        // Two maps and their images at once could be too much.
        drop(checkpoint);
        let missing: Vec<usize> = resuming.missing().collect();
        for (done, &index) in missing.iter().enumerate() {
            host.event(Event::ReadingAgain { done, total: missing.len() });
            if host.has_event_loop() {
                host.turn().await;
            }
            let frame = input.read_frame(index, host).await;
            let Some(frame) = frame.map_err(|error| RunError::Input { index, error })? else {
                let found = format!("an input that ends before frame {index}");
                return Err(RunError::Resume(wrong("frames", found, "all that were processed")));
            };
            resuming.add(&frame).map_err(RunError::Resume)?;
        }
        let slam = resuming.finish().map_err(RunError::Resume)?;
        if log.frames.len() != slam.next_frame() {
            let found = format!("a log of {} frames", log.frames.len());
            return Err(RunError::Resume(wrong(ENTRY, found, slam.next_frame())));
        }
        Ok(Run::with(slam, log, finished))
    }
}

impl Run {
    /// The state of the run, between steps, with what `kept` adds for the host. Making one changes
    /// nothing: the run goes on as it would have. `None` where there is nothing to save: before
    /// the first frame, and once the core has failed half-way.
    ///
    /// # Errors
    /// Engine failures; `kept` cannot be written as JSON.
    pub async fn checkpoint<T: Serialize>(
        &mut self,
        kept: &T,
        host: &dyn Host,
    ) -> Result<Option<Checkpoint>, SlamError> {
        if self.next_frame() == 0 || !self.settled {
            return Ok(None);
        }
        let state = Written {
            log: &self.log,
            elapsed_s: self.elapsed_s(host),
            finished: self.finished,
            host: kept,
        };
        let text = serde_json::to_string(&state)
            .map_err(|e| wrong(ENTRY, e, "numbers that JSON can hold"))?;
        let mut checkpoint = self.slam.checkpoint().await?;
        checkpoint.metadata.insert(ENTRY.into(), text);
        Ok(Some(checkpoint))
    }
}
