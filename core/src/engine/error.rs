//! What an engine could not do.
use crate::commands::BufferId;
use alloc::{string::String, vec::Vec};
use mte_slam_shaders::shader::ShaderError;

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
