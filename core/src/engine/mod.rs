//! Engines that run commands: the CPU engine (Rust twins) and the GPU engine (wgpu).
mod check;
mod cpu;
mod error;
#[cfg(feature = "gpu")]
mod gpu;
mod info;
#[cfg(feature = "gpu")]
mod oneshot;

pub use cpu::CpuEngine;
pub use error::EngineError;
#[cfg(feature = "gpu")]
pub use gpu::{AdapterDescription, GpuEngine, GpuOptions, list_adapters};
pub use info::{EngineInfo, MAX_BUFFER_BYTES};

use crate::commands::{Buffer, BufferId, Commands};
use alloc::vec::Vec;
use bytemuck::Pod;

/// Runs commands. Both kinds accept and refuse the same ones.
pub enum Engine {
    /// The kernels' Rust twins.
    Cpu(CpuEngine),
    /// The kernels' shaders.
    #[cfg(feature = "gpu")]
    Gpu(alloc::boxed::Box<GpuEngine>),
}

/// Calls a method of either engine.
macro_rules! either {
    ($engine:expr, $inner:ident => $body:expr) => {
        match $engine {
            Engine::Cpu($inner) => $body,
            #[cfg(feature = "gpu")]
            Engine::Gpu($inner) => $body,
        }
    };
}

impl Engine {
    /// A CPU engine.
    pub fn cpu() -> Self {
        Engine::Cpu(CpuEngine::new())
    }

    /// A GPU engine.
    #[cfg(feature = "gpu")]
    pub async fn gpu(options: GpuOptions) -> Result<Self, EngineError> {
        Ok(Engine::Gpu(alloc::boxed::Box::new(GpuEngine::new(options).await?)))
    }

    /// Makes a buffer of `words` 4-byte words, all zero. Refuses more than
    /// [`max_buffer_words`](Self::max_buffer_words).
    pub fn create_buffer(
        &mut self,
        name: &'static str,
        words: usize,
    ) -> Result<BufferId, EngineError> {
        either!(self, engine => engine.create_buffer(name, words))
    }

    /// As [`create_buffer`](Self::create_buffer), of a buffer that holds elements of `T`. The size is
    /// in words all the same.
    pub fn create<T>(
        &mut self,
        name: &'static str,
        words: usize,
    ) -> Result<Buffer<T>, EngineError> {
        self.create_buffer(name, words).map(Buffer::new)
    }

    /// Frees a buffer; unknown names are ignored.
    pub fn destroy_buffer(&mut self, buffer: impl Into<BufferId>) {
        let buffer = buffer.into();
        either!(self, engine => engine.destroy_buffer(buffer))
    }

    /// Runs commands, in order. With a mistake in one of them all are refused. On the GPU
    /// this returns before the work is done, and failures of earlier work may be reported here.
    pub fn submit(&mut self, commands: &Commands) -> Result<(), EngineError> {
        either!(self, engine => engine.submit(commands))
    }

    /// Reads words back after all submitted work.
    pub async fn read(
        &mut self,
        buffer: impl Into<BufferId>,
        offset_words: usize,
        words: usize,
    ) -> Result<Vec<u32>, EngineError> {
        let buffer = buffer.into();
        match self {
            Engine::Cpu(engine) => engine.read(buffer, offset_words, words),
            #[cfg(feature = "gpu")]
            Engine::Gpu(engine) => engine.read(buffer, offset_words, words).await,
        }
    }

    /// Reads `count` elements from word `offset_words` on, after all submitted work.
    pub async fn read_as<T: Pod>(
        &mut self,
        buffer: impl Into<BufferId>,
        offset_words: usize,
        count: usize,
    ) -> Result<Vec<T>, EngineError> {
        let bytes = count.saturating_mul(size_of::<T>());
        let words = self.read(buffer, offset_words, bytes.div_ceil(4)).await?;
        let bytes = &bytemuck::cast_slice::<u32, u8>(&words)[..bytes];
        let mut values = alloc::vec![T::zeroed(); count];
        bytemuck::cast_slice_mut::<T, u8>(&mut values).copy_from_slice(bytes);
        Ok(values)
    }

    /// Waits until all submitted work is done.
    pub async fn synchronise(&mut self) -> Result<(), EngineError> {
        match self {
            Engine::Cpu(_) => Ok(()),
            #[cfg(feature = "gpu")]
            Engine::Gpu(engine) => engine.synchronise().await,
        }
    }

    /// What loses the graphics device, as a driver's reset does: for tests of what comes then.
    /// `None` on the CPU, which cannot be lost.
    #[doc(hidden)]
    pub fn breaker(&self) -> Option<alloc::boxed::Box<dyn Fn()>> {
        match self {
            Engine::Cpu(_) => None,
            #[cfg(feature = "gpu")]
            Engine::Gpu(engine) => Some(engine.breaker()),
        }
    }

    /// What this runs on.
    pub fn info(&self) -> EngineInfo {
        either!(self, engine => engine.info())
    }

    /// Total size of the buffers that exist \[bytes\].
    pub fn allocated_bytes(&self) -> u64 {
        either!(self, engine => engine.allocated_bytes())
    }

    /// Most that [`Engine::allocated_bytes`] has been \[bytes\].
    pub fn peak_bytes(&self) -> u64 {
        either!(self, engine => engine.peak_bytes())
    }

    /// Largest buffer \[words\].
    pub fn max_buffer_words(&self) -> usize {
        either!(self, engine => engine.max_buffer_words())
    }
}
