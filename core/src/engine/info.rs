//! What an engine runs on, and what every engine can hold.
use alloc::string::String;

/// Largest buffer \[bytes\]: the storage binding that WebGPU grants everywhere.
pub const MAX_BUFFER_BYTES: u64 = 128 << 20;

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
