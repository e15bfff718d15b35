//! The engine that runs the kernels' Rust twins.
use super::{
    check::{Table, allocated_words, buffer_size},
    error::EngineError,
    info::{EngineInfo, MAX_BUFFER_BYTES},
};
use crate::{
    commands::{BufferId, Command, Commands},
    kernel::{CpuBinding, CpuDispatch, Kernel},
};
use alloc::{string::ToString, vec, vec::Vec};
use core::sync::atomic::AtomicU32;
use mte_slam_shaders::interface::Access;

/// Runs commands on the processor, in parallel over workgroups with the feature `threads`. It needs no adapter
/// and is the oracle of the kernels' tests.
pub struct CpuEngine {
    buffers: Table<Vec<u32>>,
}

impl Default for CpuEngine {
    fn default() -> Self {
        Self::new()
    }
}

impl CpuEngine {
    /// An engine without buffers.
    pub fn new() -> Self {
        Self { buffers: Table::new() }
    }

    /// See [`Engine::create_buffer`](super::Engine::create_buffer).
    pub fn create_buffer(
        &mut self,
        name: &'static str,
        words: usize,
    ) -> Result<BufferId, EngineError> {
        buffer_size(name, words, MAX_BUFFER_BYTES)?;
        Ok(self.buffers.insert(name, words, vec![0; allocated_words(words)]))
    }

    /// See [`Engine::destroy_buffer`](super::Engine::destroy_buffer).
    pub fn destroy_buffer(&mut self, buffer: BufferId) {
        self.buffers.remove(buffer);
    }

    /// See [`Engine::submit`](super::Engine::submit).
    pub fn submit(&mut self, commands: &Commands) -> Result<(), EngineError> {
        self.buffers.check(commands)?;
        for command in &commands.list {
            self.run(command);
        }
        Ok(())
    }

    /// Runs a command that has been checked.
    fn run(&mut self, command: &Command) {
        match *command {
            Command::Upload { buffer, offset_words, ref data } => {
                if let Some(words) = self.buffers.get_mut(buffer) {
                    words[offset_words..offset_words + data.len()].copy_from_slice(data);
                }
            }
            Command::Clear { buffer, offset_words, words: count } => {
                if let Some(words) = self.buffers.get_mut(buffer) {
                    words[offset_words..offset_words + count].fill(0);
                }
            }
            Command::Copy { src, src_offset_words, dst, dst_offset_words, words } => {
                // Taken out, so that source and destination can be borrowed together.
                let source = self.buffers.get_mut(src).map(core::mem::take).unwrap_or_default();
                if let Some(target) = self.buffers.get_mut(dst) {
                    target[dst_offset_words..dst_offset_words + words]
                        .copy_from_slice(&source[src_offset_words..src_offset_words + words]);
                }
                if let Some(slot) = self.buffers.get_mut(src) {
                    *slot = source;
                }
            }
            Command::Dispatch { kernel, ref bindings, ref params, workgroups } => {
                self.dispatch(kernel, bindings, params, workgroups);
            }
        }
    }

    fn dispatch(
        &mut self,
        kernel: &'static Kernel,
        bindings: &[BufferId],
        params: &[u32],
        workgroups: [u32; 3],
    ) {
        let mut taken: Vec<Vec<u32>> = bindings
            .iter()
            .map(|id| self.buffers.get_mut(*id).map(core::mem::take).unwrap_or_default())
            .collect();
        let bound = taken
            .iter_mut()
            .zip(kernel.interface.bindings)
            .map(|(words, binding)| match binding.access {
                Access::Read => CpuBinding::Read(words),
                Access::ReadWrite | Access::Atomic => CpuBinding::ReadWrite(as_atomics(words)),
            })
            .collect();
        (kernel.twin)(&CpuDispatch::new(
            workgroups,
            kernel.interface.workgroup_size,
            params,
            bound,
        ));
        for (id, words) in bindings.iter().zip(taken) {
            if let Some(slot) = self.buffers.get_mut(*id) {
                *slot = words;
            }
        }
    }

    /// See [`Engine::read`](super::Engine::read).
    pub fn read(
        &mut self,
        buffer: BufferId,
        offset_words: usize,
        words: usize,
    ) -> Result<Vec<u32>, EngineError> {
        let entry = self.buffers.check_range(buffer, "read", offset_words, words)?;
        Ok(entry.data[offset_words..offset_words + words].to_vec())
    }

    /// See [`Engine::info`](super::Engine::info).
    pub fn info(&self) -> EngineInfo {
        #[cfg(feature = "threads")]
        let driver = alloc::format!("{} threads", rayon::current_num_threads());
        #[cfg(not(feature = "threads"))]
        let driver = "1 thread".to_string();
        EngineInfo {
            kind: "cpu",
            adapter: CPU_NAME.to_string(),
            backend: "rust".to_string(),
            driver,
        }
    }

    /// See [`Engine::allocated_bytes`](super::Engine::allocated_bytes).
    pub fn allocated_bytes(&self) -> u64 {
        self.buffers.allocated_bytes()
    }

    /// See [`Engine::peak_bytes`](super::Engine::peak_bytes).
    pub fn peak_bytes(&self) -> u64 {
        self.buffers.peak_bytes()
    }

    /// See [`Engine::max_buffer_words`](super::Engine::max_buffer_words).
    pub fn max_buffer_words(&self) -> usize {
        (MAX_BUFFER_BYTES / 4) as usize
    }
}

/// The processor's architecture.
const CPU_NAME: &str = if cfg!(target_arch = "x86_64") {
    "x86-64"
} else if cfg!(target_arch = "aarch64") {
    "aarch64"
} else if cfg!(target_arch = "wasm32") {
    "wasm32"
} else {
    "processor"
};

/// The words as atomics, for workgroups that run in parallel. The only unsafe code of the crate;
/// `AtomicU32::from_mut_slice` will replace it once it is stable.
#[allow(unsafe_code)]
fn as_atomics(words: &mut [u32]) -> &[AtomicU32] {
    const { assert!(align_of::<AtomicU32>() == align_of::<u32>()) };
    // SAFETY: AtomicU32 has the same size and bit validity as u32, and the same alignment
    // (asserted above). The exclusive borrow is given up for the result's lifetime, so that
    // all accesses during it are atomic.
    unsafe { &*(core::ptr::from_mut(words) as *const [AtomicU32]) }
}
