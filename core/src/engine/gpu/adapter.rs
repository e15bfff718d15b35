//! Finding and describing adapters.
use super::super::{error::EngineError, info::EngineInfo};
use alloc::{format, string::String, vec::Vec};

/// Which adapter a [`GpuEngine`](super::GpuEngine) takes.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Take the first adapter whose name contains this (case does not matter); ignored on the web.
    pub adapter_name: Option<String>,
    /// Take a software adapter.
    pub force_fallback: bool,
}

/// A graphics adapter of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterDescription {
    /// The adapter's name.
    pub name: String,
    /// Graphics interface, for example `vulkan`.
    pub backend: String,
    /// Driver and its version; may be empty.
    pub driver: String,
    /// For example `DiscreteGpu` or `Cpu`.
    pub device_type: String,
    /// Largest storage binding \[bytes\].
    pub max_binding_bytes: u64,
    /// What the adapter lacks of WebGPU's default limits; empty when it can be used.
    pub missing: Vec<String>,
}

/// An instance without display: this crate only computes.
pub(super) fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle())
}

/// All adapters, usable or not. On the web only the browser's choice.
pub async fn list_adapters() -> Vec<AdapterDescription> {
    enumerate(&instance()).await.iter().map(describe).collect()
}

#[cfg(not(target_arch = "wasm32"))]
async fn enumerate(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    instance.enumerate_adapters(wgpu::Backends::all()).await
}

#[cfg(target_arch = "wasm32")]
async fn enumerate(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    instance.request_adapter(&request(false)).await.into_iter().collect()
}

fn request(force_fallback_adapter: bool) -> wgpu::RequestAdapterOptions<'static, 'static> {
    wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        force_fallback_adapter,
        ..Default::default()
    }
}

fn describe(adapter: &wgpu::Adapter) -> AdapterDescription {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    let shown = engine_info(&info);
    let mut missing = Vec::new();
    wgpu::Limits::default().check_limits_with_fail_fn(&limits, false, |name, needed, found| {
        missing.push(format!("{name} is {found}, needs {needed}"));
    });
    AdapterDescription {
        name: shown.adapter,
        backend: shown.backend,
        driver: shown.driver,
        device_type: format!("{:?}", info.device_type),
        max_binding_bytes: limits.max_storage_buffer_binding_size,
        missing,
    }
}

/// The adapter that the options ask for.
pub(super) async fn choose(
    instance: &wgpu::Instance,
    options: &GpuOptions,
) -> Result<wgpu::Adapter, EngineError> {
    let wanted = options.adapter_name.as_ref().filter(|_| !cfg!(target_arch = "wasm32"));
    let chosen = match wanted {
        None => instance.request_adapter(&request(options.force_fallback)).await.ok(),
        Some(wanted) => enumerate(instance)
            .await
            .into_iter()
            .find(|a| a.get_info().name.to_lowercase().contains(&wanted.to_lowercase())),
    };
    match chosen {
        Some(adapter) => Ok(adapter),
        None => Err(EngineError::NoAdapter {
            wanted: wanted.cloned(),
            found: enumerate(instance).await.iter().map(|a| a.get_info().name).collect(),
        }),
    }
}

/// wgpu's description in our terms.
pub(super) fn engine_info(info: &wgpu::AdapterInfo) -> EngineInfo {
    let name = if info.name.is_empty() { "WebGPU adapter" } else { &info.name };
    EngineInfo {
        kind: "gpu",
        adapter: name.into(),
        backend: format!("{}", info.backend),
        driver: format!("{} {}", info.driver, info.driver_info).trim().into(),
    }
}
