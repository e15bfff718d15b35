//! `mte-slam info`.
use crate::{args::InfoArgs, engine::is_hardware, screen::Screen};
use anyhow::Result;
use mte_slam_core::engine::MAX_BUFFER_BYTES;
use serde::Serialize;
use std::fmt::Write;

#[derive(Serialize)]
struct Adapter {
    name: String,
    backend: String,
    driver: String,
    device_type: String,
    max_binding_bytes: u64,
    /// Limits below WebGPU's defaults; empty when usable.
    missing: Vec<String>,
}

/// Lists adapters and engines.
pub fn run(_args: &InfoArgs, screen: Screen) -> Result<()> {
    let adapters = adapters();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let taken = |a: &&Adapter| a.missing.is_empty() && is_hardware(&a.device_type);
    let auto = match adapters.iter().find(taken) {
        Some(_) => "gpu",
        None => "cpu",
    };
    let mut text = format!(
        "mte-slam {}\n\nengines\n  cpu  the kernels' Rust twins on {threads} threads ({})\n  gpu  {}\n  \
         --engine auto takes: {auto}\n\nadapters\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        if cfg!(feature = "gpu") {
            "the kernels' shaders by Vulkan, Metal or DirectX 12"
        } else {
            "not in this build (feature `gpu`)"
        },
    );
    for a in &adapters {
        let _ = writeln!(text, "  {} [{}, {}]", a.name, a.backend, a.device_type);
        if !a.driver.is_empty() {
            let _ = writeln!(text, "    driver {}", a.driver);
        }
        let _ = writeln!(text, "    storage binding up to {} MiB", a.max_binding_bytes >> 20);
        if a.missing.is_empty() {
            let _ = writeln!(text, "    has WebGPU's default limits");
        } else {
            let _ = writeln!(text, "    cannot be used: {}", a.missing.join(", "));
        }
    }
    if adapters.is_empty() {
        text +=
            "  none found; on Debian `apt-get install mesa-vulkan-drivers` brings a software one\n";
    }
    let _ = writeln!(
        text,
        "\nlimits that every engine keeps\n  {} MiB a buffer, 8 storage buffers a kernel, 256 \
         invocations and 16 KiB of workgroup memory",
        MAX_BUFFER_BYTES >> 20
    );
    let json = serde_json::json!({
        "version": env!("CARGO_PKG_VERSION"),
        "threads": threads,
        "auto": auto,
        "max_buffer_bytes": MAX_BUFFER_BYTES,
        "adapters": adapters,
    });
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}

#[cfg(feature = "gpu")]
fn adapters() -> Vec<Adapter> {
    pollster::block_on(mte_slam_core::engine::list_adapters())
        .into_iter()
        .map(|a| Adapter {
            name: a.name,
            backend: a.backend,
            driver: a.driver,
            device_type: a.device_type,
            max_binding_bytes: a.max_binding_bytes,
            missing: a.missing,
        })
        .collect()
}

#[cfg(not(feature = "gpu"))]
fn adapters() -> Vec<Adapter> {
    Vec::new()
}
