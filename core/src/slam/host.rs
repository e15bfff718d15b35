//! What the program around a run lends to it: a clock, and turns of its event loop.
use super::Slam;
use crate::engine::{Engine, EngineError};
use alloc::boxed::Box;
use core::{future::Future, pin::Pin};

/// Called between slices of a long optimisation with the iterations done and their number; work
/// goes on when its future is ready. A host with an event loop returns to it here.
pub type Breathe = fn(done: u32, total: u32) -> Pin<Box<dyn Future<Output = ()>>>;

/// The hooks that a host has set.
#[derive(Clone, Copy, Default)]
pub(super) struct HostHooks {
    clock: Option<fn() -> f64>,
    breathe: Option<Breathe>,
}

impl HostHooks {
    /// The time \[s\]; 0 without a clock.
    pub fn now_s(&self) -> f64 {
        self.clock.map_or(0.0, |clock| clock())
    }

    /// Waits for the engine and gives the host its turn, if it wants one.
    pub async fn breathe(
        &self,
        engine: &mut Engine,
        done: u32,
        total: u32,
    ) -> Result<(), EngineError> {
        if let Some(breathe) = self.breathe {
            engine.synchronise().await?;
            breathe(done, total).await;
        }
        Ok(())
    }
}

impl Slam {
    /// Gives the system a clock \[s\]; without one reports carry no times.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.host.clock = Some(clock);
    }

    /// Cuts optimisations into slices of some iterations: after each the engine's work is waited
    /// for, and `breathe` is called.
    pub fn set_breathe(&mut self, breathe: Breathe) {
        self.host.breathe = Some(breathe);
    }
}
