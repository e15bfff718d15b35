//! Engines that run commands: the CPU engine (Rust twins) and the GPU engine (wgpu).
mod check;
mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(feature = "gpu")]
mod oneshot;

pub use cpu::CpuEngine;
#[cfg(feature = "gpu")]
pub use gpu::{AdapterDescription, GpuEngine, GpuOptions, list_adapters};

use crate::commands::{Buffer, BufferId, Commands};
use alloc::{string::String, vec::Vec};
use bytemuck::Pod;
use mte_slam_shaders::shader::ShaderError;

/// Largest buffer \[bytes\]: the storage binding that WebGPU grants everywhere.
pub const MAX_BUFFER_BYTES: u64 = 128 << 20;

/// What an engine could not do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// No usable graphics adapter.
    #[error("no graphics adapter{}; found: {}",
        wanted.as_ref().map(|name| alloc::format!(" whose name contains {name:?}"))
            .unwrap_or_default(),
        if found.is_empty() { String::from("none") } else { found.join(", ") })]
    NoAdapter {
        /// Part of the name that was asked for.
        wanted: Option<String>,
        /// Names of the adapters that exist.
        found: Vec<String>,
    },
    /// The adapter has less than WebGPU's default limits.
    #[error("adapter {adapter} is too small: {}", missing.join(", "))]
    LimitsTooSmall {
        /// The adapter's name.
        adapter: String,
        /// `limit is FOUND, needs NEEDED` for each limit.
        missing: Vec<String>,
    },
    /// The adapter gave no device.
    #[error("adapter {adapter} gives no device: {message}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// The driver's reason.
        message: String,
    },
    /// A buffer beyond the limit.
    #[error(
        "buffer {name} needs {bytes} bytes ({} MiB), the limit is {limit} ({} MiB): use a \
         smaller scene, a coarser grid or fewer samples",
        bytes >> 20, limit >> 20
    )]
    BufferTooLarge {
        /// The buffer's name.
        name: &'static str,
        /// Size asked for.
        bytes: u64,
        /// Largest size.
        limit: u64,
    },
    /// A buffer that was never made here, or was destroyed.
    #[error("{operation}: buffer {} does not exist (any more)", id.0)]
    UnknownBuffer {
        /// What was to be done with it.
        operation: String,
        /// The unknown name.
        id: BufferId,
    },
    /// A range that is not within its buffer.
    #[error(
        "{operation} of {words} words at {offset_words} leaves buffer {buffer} of {size_words} words"
    )]
    OutOfRange {
        /// What was to be done.
        operation: &'static str,
        /// The buffer's name.
        buffer: &'static str,
        /// First word.
        offset_words: usize,
        /// Number of words.
        words: usize,
        /// The buffer's size.
        size_words: usize,
    },
    /// Source and destination of a copy are one buffer.
    #[error("copy within buffer {buffer}: source and destination must differ")]
    CopyWithinBuffer {
        /// The buffer's name.
        buffer: &'static str,
    },
    /// A dispatch with too few or too many buffers.
    #[error("kernel {kernel} takes {expected} buffers, got {found}")]
    BindingCount {
        /// The kernel's name.
        kernel: &'static str,
        /// Length of its binding list.
        expected: usize,
        /// Buffers given.
        found: usize,
    },
    /// One buffer at two bindings of a dispatch.
    #[error("kernel {kernel}: buffer {buffer} is bound both as {first} and as {second}")]
    BoundTwice {
        /// The kernel's name.
        kernel: &'static str,
        /// The buffer's name.
        buffer: &'static str,
        /// The first binding.
        first: &'static str,
        /// The other binding.
        second: &'static str,
    },
    /// The parameter struct of another kernel.
    #[error("kernel {kernel} takes {expected} bytes of parameters, got {found}")]
    ParamsSize {
        /// The kernel's name.
        kernel: &'static str,
        /// Size of its struct.
        expected: usize,
        /// Size given.
        found: usize,
    },
    /// More workgroups than a dispatch may have.
    #[error(
        "kernel {kernel}: {workgroups:?} workgroups, the limit is 65535 per dimension and 2^32 - 1 \
         in all"
    )]
    TooManyWorkgroups {
        /// The kernel's name.
        kernel: &'static str,
        /// The counts asked for.
        workgroups: [u32; 3],
    },
    /// A shader could not be composed.
    #[error(transparent)]
    Shader(#[from] ShaderError),
    /// The device refused a call: a mistake in a shader or in the engine.
    #[error("the graphics device refused a call: {message}")]
    Validation {
        /// The device's reason.
        message: String,
    },
    /// The device has no memory left.
    #[error("the graphics device is out of memory: {message}")]
    OutOfMemory {
        /// The device's words.
        message: String,
    },
    /// The device failed inside.
    #[error("the graphics device failed: {message}")]
    Internal {
        /// The device's words.
        message: String,
    },
    /// The device is gone (driver reset, watchdog, unplugged). Make a new engine and continue
    /// from a checkpoint.
    #[error("the graphics device was lost: {message}")]
    DeviceLost {
        /// The driver's reason.
        message: String,
    },
}

impl EngineError {
    /// Whether the device failed, rather than what it was told to do: a new engine, or one with
    /// more memory, can go on from a checkpoint.
    pub fn is_device_failure(&self) -> bool {
        matches!(
            self,
            EngineError::OutOfMemory { .. }
                | EngineError::Internal { .. }
                | EngineError::DeviceLost { .. }
        )
    }
}

/// What an engine runs on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EngineInfo {
    /// `gpu` or `cpu`.
    pub kind: &'static str,
    /// Name of the adapter, or of the processor's architecture.
    pub adapter: String,
    /// Graphics interface, for example `vulkan`; `rust` on the CPU.
    pub backend: String,
    /// Driver and its version; may be empty.
    pub driver: String,
}

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
