//! What failures leave behind.
use super::*;
use crate::{
    args::{EngineArgs, EngineChoice},
    engine::{self, StartedEngine},
    screen::Screen,
    steps,
};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::SequenceError,
};

fn saver(out: &Path, saved: Option<usize>) -> Saver {
    let sequence = SyntheticSequence::new(SyntheticOptions::tiny());
    let mut saver = Saver::new(out, 50, &RunRecord::default(), &sequence, saved);
    saver.begin(&Invocation::default()).unwrap();
    saver
}

fn lost() -> anyhow::Error {
    let message = "Unknown: reset by the driver".to_owned();
    anyhow::Error::from(SlamError::Engine(EngineError::DeviceLost { message }))
        .context("frame 123 (index 123)")
}

#[test]
fn a_lost_device_names_the_checkpoint() {
    let out = tempfile::tempdir().unwrap();
    let error = saver(out.path(), Some(100)).failed(lost());
    let kind = error.downcast_ref::<Interrupted>().expect("a typed error");
    assert!(kind.device && kind.frames == Some(100));
    let message = format!("{error:#}");
    for part in ["after 100 frames", "--resume", "frame 123", "lost", "reset by the driver"] {
        assert!(message.contains(part), "{part} in {message}");
    }
    let memory = EngineError::OutOfMemory { message: "8 GiB".to_owned() };
    let error = saver(out.path(), None).failed(SlamError::Engine(memory).into());
    let message = format!("{error:#}");
    assert!(message.contains("before the first checkpoint (after 50 frames)"), "{message}");
    // The mistakes of others stay what they are, until there is something to go on from.
    let broken = || anyhow::anyhow!("000007.png: not a PNG");
    assert!(saver(out.path(), None).failed(broken()).downcast_ref::<Interrupted>().is_none());
    let error = saver(out.path(), Some(7)).failed(broken());
    assert!(!error.downcast_ref::<Interrupted>().expect("a typed error").device);
}

/// The graphics engine, or `None` with a message where there is no adapter.
fn gpu() -> Option<StartedEngine> {
    match engine::start(&EngineArgs { engine: EngineChoice::Gpu, adapter: None }) {
        Ok(started) => Some(started),
        Err(error) => {
            let required = std::env::var("MTE_SLAM_REQUIRE_GPU").is_ok_and(|value| value == "1");
            assert!(!required, "MTE_SLAM_REQUIRE_GPU=1: {error:#}");
            println!("skipped: {error:#}");
            None
        }
    }
}

/// A recording during which, before frame `at`, something happens.
struct Eventful {
    room: SyntheticSequence,
    at: usize,
    event: Box<dyn Fn()>,
}

impl Sequence for Eventful {
    fn info(&self) -> &SequenceInfo {
        self.room.info()
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        if index == self.at {
            (self.event)();
        }
        self.room.frame(index)
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        self.room.truth(index)
    }

    fn time_s(&self, index: usize) -> f64 {
        self.room.time_s(index)
    }
}

#[test]
fn a_device_lost_in_the_middle_leaves_a_run_to_go_on_with() {
    const FRAMES: usize = 7;
    let Some(started) = gpu() else { return };
    let out = tempfile::tempdir().unwrap();
    let options = SyntheticOptions { width: 64, height: 48, frames: FRAMES, ..Default::default() };
    let room = || SyntheticSequence::new(options);
    let mut config = Config { seed: 5, ..Config::default() };
    config.tracking.align_pixels = 512;
    (config.mapping.every, config.mapping.rays) = (2, 400);
    (config.mapping.first_iterations, config.mapping.iterations) = (20, 4);
    (config.mapping.final_iterations, config.mapping.semantic_iterations) = (4, 4);
    (config.sampling.stratified, config.sampling.surface) = (12, 4);
    let mut record = RunRecord::default();
    record.set_engine(&started.record);
    let quiet = Screen { quiet: true, json: false };

    let event = started.engine.breaker().expect("a GPU engine");
    let mut sequence = Eventful { room: room(), at: 5, event };
    let run = Run::new(started.engine, config.clone(), sequence.info());
    let mut run = block_on(run).unwrap();
    let mut saver = Saver::new(out.path(), 2, &record, &sequence, None);
    saver.begin(&Invocation::default()).unwrap();
    let mut progress = quiet.progress("", FRAMES);
    let mut terminal = Terminal::new(&mut progress, &sequence);
    let error = steps::take_all(&mut run, &mut sequence, "room", Some(&mut saver), &mut terminal);
    let error = saver.failed(error.expect_err("the device is gone"));
    let kind = error.downcast_ref::<Interrupted>().expect("a typed error");
    assert!(kind.device && kind.frames == Some(4), "{error:#}");
    let is_loss = |cause: &(dyn std::error::Error + 'static)| {
        let cause = cause.downcast_ref::<SlamError>();
        matches!(cause, Some(SlamError::Engine(EngineError::DeviceLost { .. })))
    };
    assert!(error.chain().any(is_loss), "{error:#}");
    drop(run);

    // Another engine takes over what was saved, and says that it has.
    let saved = find(out.path()).unwrap().expect("a checkpoint");
    assert_eq!(saved.frames(), 4);
    let mut sequence = room();
    record.set_engine(
        &engine::start(&EngineArgs { engine: EngineChoice::Cpu, adapter: None }).unwrap().record,
    );
    let resumed = saved.resume(Engine::cpu(), &config, &mut sequence, &record);
    let mut run = resumed.unwrap();
    steps::take_all(&mut run, &mut sequence, "room", None, &mut terminal).unwrap();
    let (slam, log) = run.into_parts();
    assert_eq!((log.frames.len(), slam.trajectory().len()), (FRAMES, FRAMES));
    assert!(log.notes[0].contains("resumed after frame 4 on another engine"), "{:?}", log.notes);
}
