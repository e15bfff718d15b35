//! The engine that runs the kernels' shaders on wgpu.
mod adapter;
mod encode;

pub use adapter::{AdapterDescription, GpuOptions, list_adapters};

use super::{
    check::{Table, allocated_words, buffer_size},
    error::EngineError,
    info::{EngineInfo, MAX_BUFFER_BYTES},
    oneshot,
};
use crate::{
    commands::{BufferId, Command, Commands},
    kernel::Kernel,
};
use alloc::{collections::BTreeMap, format, string::String, sync::Arc, vec::Vec};
use core::num::NonZeroU64;
use mte_slam_shaders::{interface::Access, shader};
use std::sync::Mutex;

/// Bytes of parameter structs in one submission.
const UNIFORM_BYTES: u64 = 64 << 10;

/// A compiled kernel and its bind groups by buffers.
struct Compiled {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    groups: BTreeMap<Vec<BufferId>, wgpu::BindGroup>,
}

/// Failures that arrive by callback until somebody asks.
#[derive(Default)]
struct Failures {
    /// The first one not yet reported.
    pending: Option<EngineError>,
    /// Why the device is gone; stays.
    lost: Option<String>,
}

/// Runs commands on a graphics adapter with no more than WebGPU's default limits. Stays on the
/// thread that made it on the web.
pub struct GpuEngine {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: EngineInfo,
    max_buffer_bytes: u64,
    buffers: Table<wgpu::Buffer>,
    /// By address of the kernel, which is static.
    kernels: BTreeMap<usize, Compiled>,
    uniforms: wgpu::Buffer,
    /// Kept for the next read-back; absent while one is under way.
    staging: Option<wgpu::Buffer>,
    failures: Arc<Mutex<Failures>>,
}

impl GpuEngine {
    /// Asks for an adapter and a device.
    pub async fn new(options: GpuOptions) -> Result<Self, EngineError> {
        let instance = adapter::instance();
        let adapter = adapter::choose(&instance, &options).await?;
        let info = adapter.get_info();
        let limits = wgpu::Limits::default();
        let mut missing = Vec::new();
        limits.check_limits_with_fail_fn(&adapter.limits(), false, |name, needed, found| {
            missing.push(format!("{name} is {found}, needs {needed}"));
        });
        if !missing.is_empty() {
            return Err(EngineError::LimitsTooSmall { adapter: info.name, missing });
        }
        let max_buffer_bytes = MAX_BUFFER_BYTES
            .min(limits.max_storage_buffer_binding_size)
            .min(limits.max_buffer_size);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("mte-slam"),
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|error| {
            EngineError::NoDevice { adapter: info.name.clone(), message: format!("{error}") }
        })?;
        let failures = Arc::new(Mutex::new(Failures::default()));
        report_failures(&device, &failures);
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("params"),
            size: UNIFORM_BYTES,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let engine = Self {
            device,
            queue,
            info: adapter::engine_info(&info),
            max_buffer_bytes,
            buffers: Table::new(),
            kernels: BTreeMap::new(),
            uniforms,
            staging: None,
            failures,
        };
        engine.check_failures()?;
        Ok(engine)
    }

    /// Compiles kernels before their first use, which on some drivers takes seconds.
    pub async fn precompile(&mut self, kernels: &[&'static Kernel]) -> Result<(), EngineError> {
        for kernel in kernels {
            let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
            let result = self.compile(kernel);
            let error = scope.pop().await;
            result?;
            if let Some(error) = error {
                self.kernels.remove(&address(kernel));
                let message = format!("kernel {}: {error}", kernel.interface.name);
                return Err(EngineError::Validation { message });
            }
        }
        self.check_failures()
    }

    /// See [`Engine::create_buffer`](super::Engine::create_buffer).
    pub fn create_buffer(
        &mut self,
        name: &'static str,
        words: usize,
    ) -> Result<BufferId, EngineError> {
        self.check_failures()?;
        buffer_size(name, words, self.max_buffer_bytes)?;
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: 4 * allocated_words(words) as u64,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        // Natively an out-of-memory error has arrived by now; on the web it comes with a later call.
        self.check_failures()?;
        Ok(self.buffers.insert(name, words, buffer))
    }

    /// See [`Engine::destroy_buffer`](super::Engine::destroy_buffer).
    pub fn destroy_buffer(&mut self, id: BufferId) {
        if let Some(buffer) = self.buffers.remove(id) {
            for kernel in self.kernels.values_mut() {
                kernel.groups.retain(|bound, _| !bound.contains(&id));
            }
            // Submitted work still sees it.
            buffer.destroy();
        }
    }

    /// See [`Engine::submit`](super::Engine::submit).
    pub fn submit(&mut self, commands: &Commands) -> Result<(), EngineError> {
        self.check_failures()?;
        self.buffers.check(commands)?;
        for command in &commands.list {
            if let Command::Dispatch { kernel, bindings, .. } = command {
                self.compile(kernel)?;
                self.bind(kernel, bindings)?;
            }
        }
        self.encode(commands)?;
        self.check_failures()
    }

    /// See [`Engine::read`](super::Engine::read).
    pub async fn read(
        &mut self,
        buffer: BufferId,
        offset_words: usize,
        words: usize,
    ) -> Result<Vec<u32>, EngineError> {
        self.check_failures()?;
        let source = &self.buffers.check_range(buffer, "read", offset_words, words)?.data;
        if words == 0 {
            return Ok(Vec::new());
        }
        let bytes = 4 * words as u64;
        // Taken out: a read that is abandoned half-way must not leave a mapped buffer behind.
        let staging = match self.staging.take() {
            Some(staging) if staging.size() >= bytes => staging,
            _ => self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read-back"),
                size: bytes.next_power_of_two().max(4096),
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(source, 4 * offset_words as u64, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = oneshot::channel();
        staging.map_async(wgpu::MapMode::Read, 0..bytes, |result| sender.send(result));
        let mapped = self.wait(receiver).await?;
        self.check_failures()?;
        let unreadable = |message: String| EngineError::Internal { message };
        mapped.map_err(|error| unreadable(format!("read-back: {error}")))?;
        let view = staging
            .get_mapped_range(0..bytes)
            .map_err(|error| unreadable(format!("read-back: {error}")))?;
        let mut data = alloc::vec![0u32; words];
        bytemuck::cast_slice_mut::<u32, u8>(&mut data).copy_from_slice(&view);
        drop(view);
        staging.unmap();
        self.staging = Some(staging);
        Ok(data)
    }

    /// See [`Engine::synchronise`](super::Engine::synchronise).
    pub async fn synchronise(&mut self) -> Result<(), EngineError> {
        let (sender, receiver) = oneshot::channel();
        self.queue.on_submitted_work_done(|| sender.send(()));
        self.wait(receiver).await?;
        self.check_failures()
    }

    /// See [`Engine::breaker`](super::Engine::breaker).
    pub(super) fn breaker(&self) -> alloc::boxed::Box<dyn Fn()> {
        let device = self.device.clone();
        alloc::boxed::Box::new(move || device.destroy())
    }

    /// See [`Engine::info`](super::Engine::info).
    pub fn info(&self) -> EngineInfo {
        self.info.clone()
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
        (self.max_buffer_bytes / 4) as usize
    }

    /// The value of a callback that comes once the queue is empty.
    async fn wait<T>(&self, receiver: oneshot::Receiver<T>) -> Result<T, EngineError> {
        // The browser runs callbacks by itself; natively they run inside `poll`.
        #[cfg(target_arch = "wasm32")]
        return Ok(receiver.await);
        #[cfg(not(target_arch = "wasm32"))]
        {
            let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
            self.check_failures()?;
            polled.map_err(|error| EngineError::Internal { message: format!("{error}") })?;
            receiver.take().ok_or_else(|| EngineError::Internal {
                message: "the device is idle and has not answered".into(),
            })
        }
    }

    /// Reports what callbacks have left.
    fn check_failures(&self) -> Result<(), EngineError> {
        if oneshot::lock(&self.failures).pending.is_some() {
            // Calls on a lost device are refused as mistakes before its loss is told, which comes
            // with a poll; what polling says itself is among the failures then.
            let _ = self.device.poll(wgpu::PollType::Poll);
        }
        let mut failures = oneshot::lock(&self.failures);
        if let Some(message) = &failures.lost {
            return Err(EngineError::DeviceLost { message: message.clone() });
        }
        failures.pending.take().map_or(Ok(()), Err)
    }

    /// Compiles a kernel unless that was done before.
    fn compile(&mut self, kernel: &'static Kernel) -> Result<(), EngineError> {
        if self.kernels.contains_key(&address(kernel)) {
            return Ok(());
        }
        let source = shader::compose(kernel.interface, &[])?;
        let device = &self.device;
        let label = Some(kernel.interface.name);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let entry =
            |binding, ty, has_dynamic_offset, min_binding_size| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size },
                count: None,
            };
        let params_size = NonZeroU64::new(params_bytes(kernel));
        let mut entries =
            alloc::vec![entry(0, wgpu::BufferBindingType::Uniform, true, params_size)];
        entries.extend(kernel.interface.bindings.iter().zip(1..).map(|(binding, number)| {
            let read_only = binding.access == Access::Read;
            entry(number, wgpu::BufferBindingType::Storage { read_only }, false, None)
        }));
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label,
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        self.check_failures()?;
        let compiled = Compiled { pipeline, layout, groups: BTreeMap::new() };
        self.kernels.insert(address(kernel), compiled);
        Ok(())
    }

    /// Makes the bind group of a compiled kernel over these buffers unless there is one.
    fn bind(&mut self, kernel: &'static Kernel, bindings: &[BufferId]) -> Result<(), EngineError> {
        let Some(compiled) = self.kernels.get_mut(&address(kernel)) else {
            return Ok(());
        };
        if compiled.groups.contains_key(bindings) {
            return Ok(());
        }
        let mut entries = alloc::vec![wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &self.uniforms,
                offset: 0,
                size: NonZeroU64::new(params_bytes(kernel)),
            }),
        }];
        for (id, binding) in bindings.iter().zip(1..) {
            let buffer =
                &self.buffers.get(*id, || format!("kernel {}", kernel.interface.name))?.data;
            entries.push(wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
        }
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.interface.name),
            layout: &compiled.layout,
            entries: &entries,
        });
        compiled.groups.insert(bindings.to_vec(), group);
        self.check_failures()
    }
}

/// Identifies a static kernel.
fn address(kernel: &'static Kernel) -> usize {
    core::ptr::from_ref(kernel).addr()
}

/// Size of a kernel's uniform binding: WGSL rounds structs with 4-vectors up to 16 bytes.
fn params_bytes(kernel: &Kernel) -> u64 {
    (kernel.interface.params.size as u64).next_multiple_of(16).max(16)
}

/// Collects what wgpu reports by callbacks.
fn report_failures(device: &wgpu::Device, failures: &Arc<Mutex<Failures>>) {
    let shared = failures.clone();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        let message = format!("{error}");
        let error = match error {
            wgpu::Error::OutOfMemory { .. } => EngineError::OutOfMemory { message },
            wgpu::Error::Validation { .. } => EngineError::Validation { message },
            wgpu::Error::Internal { .. } => EngineError::Internal { message },
        };
        oneshot::lock(&shared).pending.get_or_insert(error);
    }));
    let shared = failures.clone();
    device.set_device_lost_callback(move |reason, message| {
        oneshot::lock(&shared).lost = Some(format!("{reason:?}: {message}"));
    });
}
