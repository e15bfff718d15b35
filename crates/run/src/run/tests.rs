//! Runs over a few frames of the built-in room.
use super::*;
use crate::{Live, SavedRun, Turn};
use mte_slam_core::slam::Checkpoint;
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::sequence::Sequence;
use pollster::block_on;
use std::{cell::Cell, convert::Infallible, ops::Range};

const FRAMES: usize = 5;

fn room() -> SyntheticSequence {
    SyntheticSequence::new(SyntheticOptions {
        width: 64,
        height: 48,
        frames: FRAMES,
        ..SyntheticOptions::tiny()
    })
}

fn config() -> Config {
    let mut config = Config { seed: 5, ..Config::default() };
    config.tracking.align_pixels = 256;
    (config.mapping.every, config.mapping.rays) = (2, 128);
    (config.mapping.first_iterations, config.mapping.iterations) = (8, 4);
    (config.mapping.final_iterations, config.mapping.semantic_iterations) = (24, 4);
    (config.sampling.stratified, config.sampling.surface) = (8, 4);
    (config.fusion.enabled, config.suppressor.enabled) = (false, true);
    config.suppressor.settle_share = 0.5;
    config
}

fn run(info: &SequenceInfo) -> Run {
    block_on(Run::new(Engine::cpu(), config(), info)).unwrap()
}

/// The state of a run without a host, times and all.
fn state(run: &mut Run) -> Checkpoint {
    block_on(run.checkpoint(&(), &())).unwrap().expect("a state")
}

/// The state of a whole run.
fn uninterrupted() -> Checkpoint {
    let mut room = room();
    let mut run = run(room.info());
    block_on(run.to_end(&mut room, &mut ())).unwrap();
    state(&mut run)
}

fn poses(run: &Run) -> Vec<u64> {
    let pose = |p: &mte_slam_core::slam::PoseEstimate| p.world_from_camera.to_row_major();
    run.slam().trajectory().iter().flat_map(pose).map(f64::to_bits).collect()
}

/// Writes down what happens; its clock counts how often it was looked at.
#[derive(Default)]
struct Recorder {
    event_loop: bool,
    now: Cell<u32>,
    turns: usize,
    seen: Vec<String>,
}

impl Host for Recorder {
    fn now_s(&self) -> f64 {
        self.now.set(self.now.get() + 1);
        self.now.get().into()
    }

    fn has_event_loop(&self) -> bool {
        self.event_loop
    }

    fn turn(&mut self) -> Turn<'_> {
        self.turns += 1;
        Box::pin(std::future::ready(()))
    }

    fn event(&mut self, event: Event<'_>) {
        self.seen.push(match event {
            Event::Frame { frame, info } => {
                assert_eq!(frame.color.len(), info.camera.pixels());
                format!("frame {}", frame.index)
            }
            Event::Processed { report, log, slam } => {
                assert_eq!((log.frame, log.status), (slam.next_frame() - 1, report.status));
                assert!(log.tracking_s > 0.0 && log.total_s > log.tracking_s);
                format!("processed {}", log.frame)
            }
            Event::Optimised { done, total } => format!("optimised {done}/{total}"),
            Event::Finishing { iterations, more } => format!("finishing {iterations} {more}"),
            Event::ReadingAgain { done, total } => format!("reading {done}/{total}"),
            Event::Notice(text) => text.to_owned(),
        });
    }
}

fn frames(range: Range<usize>) -> impl Iterator<Item = String> {
    range.flat_map(|i| [format!("frame {i}"), format!("processed {i}")])
}

#[test]
fn a_host_follows_a_run_in_order() {
    let mut room = room();
    let mut plain = run(room.info());
    let mut host = Recorder::default();
    block_on(plain.to_end(&mut room, &mut host)).unwrap();
    let mut expected: Vec<String> = frames(0..FRAMES).collect();
    // 24 iterations of the map, 4 of its semantics and 2 of the anchors, in parts of at most 20.
    let parts = [(20, true), (24, true), (28, true), (30, false)];
    expected.extend(parts.map(|(iterations, more)| format!("finishing {iterations} {more}")));
    assert_eq!(host.seen, expected);
    assert_eq!(host.turns, 0);
    let log = plain.log();
    assert_eq!(log.frames.len(), FRAMES);
    for (i, frame) in log.frames.iter().enumerate() {
        // Every second frame is mapped, and one that the odometry takes for a keyframe.
        assert!(frame.losses.is_some() || i % 2 == 1, "frame {i}");
        assert_eq!(frame.mapping_s > 0.0, frame.losses.is_some(), "frame {i}");
    }
    assert!(log.finish_s > 0.0 && plain.is_finished());
    // A run that is complete does nothing more.
    assert!(matches!(block_on(plain.step(&mut room, &mut host)).unwrap(), Step::Done));
    assert_eq!(host.seen, expected);

    let mut sliced = run(room.info());
    let mut host = Recorder { event_loop: true, ..Recorder::default() };
    block_on(sliced.to_end(&mut room, &mut host)).unwrap();
    assert_eq!(poses(&sliced), poses(&plain), "an event loop must change no result");
    let first = ["frame 0", "optimised 4/8", "optimised 8/8", "processed 0", "frame 1"];
    assert_eq!(host.seen[..5], first);
    let slices = host.seen.iter().filter(|e| e.starts_with("optimised")).count();
    assert_eq!(host.turns, FRAMES + slices);
}

#[test]
fn live_frames_need_no_number() {
    let mut room = room();
    let mut known = run(room.info());
    block_on(known.to_end(&mut room, &mut ())).unwrap();

    let mut next = 0;
    let info = SequenceInfo { frames: 0, ..room.info().clone() };
    let mut camera = Live::new(|| {
        let frame = room.frame(next).ok()?;
        next += 1;
        // As a camera has them: counted by nobody.
        Some(Frame { index: 0, ..frame })
    });
    let mut live = run(&info);
    block_on(live.to_end(&mut camera, &mut ())).unwrap();
    assert_eq!(poses(&live), poses(&known));
    assert_eq!(state(&mut live).tensors, state(&mut known).tensors);
    assert_eq!(next, FRAMES, "no frame is asked for after the end");

    // Ended by its user.
    let mut room = self::room();
    let mut short = run(&info);
    for _ in 0..3 {
        block_on(short.step(&mut room_without_end(&mut room), &mut ())).unwrap();
    }
    block_on(short.finish(&mut ())).unwrap();
    assert!(short.is_finished() && short.next_frame() == 3);
    let step = block_on(short.step(&mut room_without_end(&mut room), &mut ())).unwrap();
    assert!(matches!(step, Step::Done));
}

/// The room again and again, frame by frame as they are asked for.
fn room_without_end(room: &mut SyntheticSequence) -> impl Input<Error = Infallible> + use<'_> {
    struct Endless<'a>(&'a mut SyntheticSequence);
    impl Input for Endless<'_> {
        type Error = Infallible;

        async fn read_frame(
            &mut self,
            index: usize,
            _: &mut dyn Host,
        ) -> Result<Option<Frame>, Infallible> {
            let frame = self.0.frame(index % FRAMES).expect("a frame of the room");
            Ok(Some(Frame { index, ..frame }))
        }
    }
    Endless(room)
}

#[test]
fn a_resumed_run_ends_with_the_same_bytes() {
    let whole = uninterrupted();
    // In the middle of the frames, after the last one, in the last optimisation, and at the end.
    for steps in [3, FRAMES, FRAMES + 1, FRAMES + 4] {
        let mut room = room();
        let mut first = run(room.info());
        for _ in 0..steps {
            block_on(first.step(&mut room, &mut ())).unwrap();
        }
        let bytes = block_on(first.checkpoint(&"kept", &())).unwrap().unwrap().to_bytes();
        drop(first);

        let saved = SavedRun::<String>::new(Checkpoint::from_bytes(&bytes).unwrap()).unwrap();
        assert_eq!((saved.host.as_str(), saved.frames()), ("kept", steps.min(FRAMES)));
        let info = room.info().clone();
        let mut host = Recorder::default();
        let resumed = saved.resume(Engine::cpu(), config(), &info, &mut room, &mut host);
        let mut resumed = block_on(resumed).unwrap();
        assert!(host.seen.iter().all(|e| e.starts_with("reading")) && !host.seen.is_empty());
        assert_eq!(resumed.is_finished(), steps == FRAMES + 4);
        block_on(resumed.to_end(&mut room, &mut ())).unwrap();
        assert!(state(&mut resumed) == whole, "resumed after {steps} steps");
    }
}

/// Fails once at frame 2, and ends before frame `end`.
struct Unsteady {
    room: SyntheticSequence,
    failed: bool,
    end: usize,
}

impl Input for Unsteady {
    type Error = &'static str;

    async fn read_frame(
        &mut self,
        index: usize,
        host: &mut dyn Host,
    ) -> Result<Option<Frame>, &'static str> {
        if index == 2 && !std::mem::replace(&mut self.failed, true) {
            host.event(Event::Notice("the cable is loose"));
            return Err("no frame");
        }
        Ok((index < self.end).then(|| self.room.frame(index).expect("a frame of the room")))
    }
}

#[test]
fn a_frame_that_fails_can_be_asked_for_again() {
    let mut input = Unsteady { room: room(), failed: false, end: FRAMES };
    let mut run = run(input.room.info());
    assert!(block_on(run.checkpoint(&(), &())).unwrap().is_none(), "nothing to save yet");
    let mut host = Recorder::default();
    let error = block_on(run.to_end(&mut input, &mut host)).err().unwrap();
    assert!(
        matches!(error, RunError::Input { index: 2, error: "no frame" }) && error.slam().is_none()
    );
    assert_eq!(host.seen.last().unwrap(), "the cable is loose");
    let half = state(&mut run);
    block_on(run.to_end(&mut input, &mut ())).unwrap();
    assert_eq!(state(&mut run).tensors, uninterrupted().tensors);

    // Without the frames that were processed there is no way back.
    input.end = 1;
    let info = input.room.info().clone();
    let resume = SavedRun::<()>::new(half).unwrap();
    let error = block_on(resume.resume(Engine::cpu(), config(), &info, &mut input, &mut ()));
    let error = error.err().unwrap();
    assert!(matches!(error, RunError::Resume(SlamError::Checkpoint { .. })), "{error}");
}

#[test]
fn a_state_of_something_else_is_refused() {
    let error = |checkpoint| SavedRun::<()>::new(checkpoint).err().unwrap().to_string();
    assert!(error(Checkpoint::default()).contains("run: found nothing"));
    let mut other = Checkpoint::default();
    other.metadata.insert("run".into(), "{}".into());
    assert!(error(other).contains("missing field"));
}
