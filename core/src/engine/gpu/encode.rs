//! Turning checked commands into submissions.
use super::{super::error::EngineError, GpuEngine, UNIFORM_BYTES, address};
use crate::commands::{Command, Commands};
use alloc::vec::Vec;
use wgpu::util::DeviceExt as _;

/// Dispatches in one submission: short submissions keep watchdogs quiet and the device busy while
/// the next one is encoded.
const MAX_DISPATCHES: usize = 64;

/// Parameter structs start at multiples of this (WebGPU's least alignment of dynamic offsets).
const UNIFORM_ALIGNMENT: usize = 256;

/// The submission under construction.
struct Batch {
    encoder: wgpu::CommandEncoder,
    /// Open while dispatches follow each other.
    pass: Option<wgpu::ComputePass<'static>>,
    /// Parameter structs of its dispatches.
    uniforms: Vec<u8>,
    dispatches: usize,
    empty: bool,
}

impl Batch {
    fn new(device: &wgpu::Device) -> Self {
        Self {
            encoder: device.create_command_encoder(&Default::default()),
            pass: None,
            uniforms: Vec::new(),
            dispatches: 0,
            empty: true,
        }
    }

    /// The encoder, outside any compute pass.
    fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.pass = None;
        self.empty = false;
        &mut self.encoder
    }

    fn pass(&mut self) -> &mut wgpu::ComputePass<'static> {
        self.empty = false;
        self.pass.get_or_insert_with(|| {
            self.encoder.begin_compute_pass(&Default::default()).forget_lifetime()
        })
    }

    /// Room for another struct of `bytes` bytes?
    fn has_room(&self, bytes: usize) -> bool {
        self.dispatches < MAX_DISPATCHES && self.uniforms.len() + bytes <= UNIFORM_BYTES as usize
    }

    fn submit(mut self, engine: &GpuEngine) {
        self.pass = None;
        if !self.uniforms.is_empty() {
            // Takes effect after earlier submissions and before this one.
            engine.queue.write_buffer(&engine.uniforms, 0, &self.uniforms);
        }
        if !self.empty {
            engine.queue.submit([self.encoder.finish()]);
        }
    }
}

impl GpuEngine {
    /// Encodes and submits; pipelines and bind groups exist already.
    pub(super) fn encode(&self, commands: &Commands) -> Result<(), EngineError> {
        let mut batch = Batch::new(&self.device);
        let buffer = |id, operation: &str| {
            self.buffers.get(id, || operation.into()).map(|entry| &entry.data)
        };
        for command in &commands.list {
            match *command {
                Command::Upload { buffer: id, offset_words, ref data } => {
                    let (target, offset) = (buffer(id, "upload")?, 4 * offset_words as u64);
                    let bytes: &[u8] = bytemuck::cast_slice(data);
                    if batch.empty {
                        self.queue.write_buffer(target, offset, bytes);
                    } else {
                        // Queue writes would overtake what is encoded already.
                        let init = wgpu::util::BufferInitDescriptor {
                            label: Some("upload"),
                            contents: bytes,
                            usage: wgpu::BufferUsages::COPY_SRC,
                        };
                        let source = self.device.create_buffer_init(&init);
                        let size = bytes.len() as u64;
                        batch.encoder().copy_buffer_to_buffer(&source, 0, target, offset, size);
                    }
                }
                Command::Clear { buffer: id, offset_words, words } => {
                    let (target, offset) = (buffer(id, "clear")?, 4 * offset_words as u64);
                    batch.encoder().clear_buffer(target, offset, Some(4 * words as u64));
                }
                Command::Copy { src, src_offset_words, dst, dst_offset_words, words } => {
                    batch.encoder().copy_buffer_to_buffer(
                        buffer(src, "copy from")?,
                        4 * src_offset_words as u64,
                        buffer(dst, "copy to")?,
                        4 * dst_offset_words as u64,
                        4 * words as u64,
                    );
                }
                Command::Dispatch { kernel, ref bindings, ref params, workgroups } => {
                    let Some(compiled) = self.kernels.get(&address(kernel)) else { continue };
                    let Some(group) = compiled.groups.get(bindings) else { continue };
                    let params: &[u8] = bytemuck::cast_slice(params);
                    let slot = params.len().max(1).next_multiple_of(UNIFORM_ALIGNMENT);
                    if !batch.has_room(slot) {
                        core::mem::replace(&mut batch, Batch::new(&self.device)).submit(self);
                    }
                    let offset = batch.uniforms.len();
                    batch.uniforms.extend_from_slice(params);
                    batch.uniforms.resize(offset + slot, 0);
                    batch.dispatches += 1;
                    let pass = batch.pass();
                    pass.set_pipeline(&compiled.pipeline);
                    pass.set_bind_group(0, group, &[offset as u32]);
                    let [x, y, z] = workgroups;
                    pass.dispatch_workgroups(x, y, z);
                }
            }
        }
        batch.submit(self);
        Ok(())
    }
}
