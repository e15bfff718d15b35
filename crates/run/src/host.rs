//! The program around a run.
use crate::log::FrameLog;
use mte_slam_core::slam::{FrameReport, Pace, Slam, Turn};
use mte_slam_types::frame::{Frame, SequenceInfo};

/// What happens in a run, as it happens.
#[non_exhaustive]
pub enum Event<'a> {
    /// A frame has arrived and is processed next.
    Frame {
        /// The frame.
        frame: &'a Frame,
        /// What is the same for all frames.
        info: &'a SequenceInfo,
    },
    /// A frame was tracked and, when it was due, mapped.
    Processed {
        /// What happened to it.
        report: &'a FrameReport,
        /// What the run keeps of it.
        log: &'a FrameLog,
        /// The map and the poses so far.
        slam: &'a Slam,
    },
    /// A slice of an optimisation is done; only for hosts with an event loop.
    Optimised {
        /// Iterations done.
        done: u32,
        /// Iterations of this optimisation.
        total: u32,
    },
    /// A part of the last optimisation, over all keyframes, is done.
    Finishing {
        /// Iterations of the last optimisation that are done.
        iterations: u32,
        /// Whether there is more to do.
        more: bool,
    },
    /// A resumed run reads the frames again that its map and odometry hold.
    ReadingAgain {
        /// Frames read.
        done: usize,
        /// Frames to read.
        total: usize,
    },
    /// Something that an input has to say and that stops nothing, such as a lost connection that
    /// is being restored.
    Notice(&'a str),
}

/// The program around a run: its clock, its event loop, and whoever follows what happens. Every
/// method has a default, which is a program without any of them.
pub trait Host {
    /// Time since any fixed moment \[s\].
    fn now_s(&self) -> f64 {
        0.0
    }

    /// Whether work is interrupted now and then for [`Host::turn`]. Each interruption waits for
    /// the device, so a program without an event loop is faster without. No result depends on it.
    fn has_event_loop(&self) -> bool {
        false
    }

    /// A turn of the event loop: ready when what was waiting there has been handled.
    fn turn(&mut self) -> Turn<'_> {
        Box::pin(std::future::ready(()))
    }

    /// Called as things happen.
    fn event(&mut self, event: Event<'_>) {
        let _ = event;
    }
}

/// No clock, no event loop, and nobody who follows.
impl Host for () {}

/// A host as the core sees it.
pub(crate) struct Paced<'a>(pub &'a mut dyn Host);

impl Pace for Paced<'_> {
    fn now_s(&self) -> f64 {
        self.0.now_s()
    }

    fn has_event_loop(&self) -> bool {
        self.0.has_event_loop()
    }

    fn turn(&mut self, done: u32, total: u32) -> Turn<'_> {
        self.0.event(Event::Optimised { done, total });
        self.0.turn()
    }
}
