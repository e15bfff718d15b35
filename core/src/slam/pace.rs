//! What a long computation asks of the program around it.
use alloc::boxed::Box;
use core::{future::Future, pin::Pin};

/// Ready when a host's event loop has handled what was waiting.
pub type Turn<'a> = Pin<Box<dyn Future<Output = ()> + 'a>>;

/// Time, and a place in an event loop. Both belong to the program around the system; the default
/// has neither, and everything is computed in one go.
pub trait Pace {
    /// Time since any fixed moment \[s\], for the times in reports.
    fn now_s(&self) -> f64 {
        0.0
    }

    /// Whether optimisations are cut into slices of some iterations: after each the device's work
    /// is waited for, and [`Pace::turn`] is called. It changes no result.
    fn has_event_loop(&self) -> bool {
        false
    }

    /// Called between slices with the iterations done and their number; work continues when the
    /// future is ready.
    fn turn(&mut self, done: u32, total: u32) -> Turn<'_> {
        let _ = (done, total);
        Box::pin(core::future::ready(()))
    }
}

/// No clock and no event loop.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unpaced;

impl Pace for Unpaced {}
