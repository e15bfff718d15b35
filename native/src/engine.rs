//! Choosing the engine.
use crate::{
    args::{EngineArgs, EngineChoice},
    errors::usage,
    output::metrics::EngineRecord,
};
use anyhow::{Result, bail};
use mte_slam_core::engine::Engine;

/// An engine that was started, and what is said about it.
pub struct StartedEngine {
    /// The engine.
    pub engine: Engine,
    /// For metrics.json.
    pub record: EngineRecord,
    /// A clause for the screen.
    pub note: String,
}

/// Whether `auto` takes an adapter of this type. Software adapters run the shaders on the same
/// processor as the twins, at half their speed (`mte-slam bench` on llvmpipe) and only after
/// compiling them for the better part of a minute.
pub fn is_hardware(device_type: &str) -> bool {
    device_type != "Cpu"
}

/// Starts the engine that the flags ask for. `auto` takes a hardware adapter if there is one and
/// else the processor, and the note says which and why. An adapter that was named is never
/// replaced by another.
pub fn start(args: &EngineArgs) -> Result<StartedEngine> {
    if args.engine == EngineChoice::Cpu {
        if let Some(name) = &args.adapter {
            usage!(
                "--adapter {name}: found --engine cpu, which has no adapter, expected --engine gpu \
                 or auto"
            );
        }
        return Ok(describe(Engine::cpu(), String::new()));
    }
    let automatic = args.engine == EngineChoice::Auto && args.adapter.is_none();
    if automatic && let Some(reason) = only_software() {
        return Ok(describe(Engine::cpu(), format!(", because: {reason}")));
    }
    match start_gpu(args.adapter.as_deref()) {
        Ok(engine) => Ok(describe(engine, String::new())),
        Err(reason) if automatic => Ok(describe(Engine::cpu(), format!(", because: {reason}"))),
        Err(reason) => {
            let flag = match &args.adapter {
                Some(name) => format!("--adapter {name}"),
                None => "--engine gpu".to_owned(),
            };
            bail!(
                "{flag}: {reason}. `mte-slam info` lists the adapters; --engine auto or cpu works \
                 without one."
            )
        }
    }
}

/// Whether the flags ask for, or `auto` would take, a graphics adapter; starts nothing.
pub fn takes_adapter(args: &EngineArgs) -> bool {
    match args.engine {
        EngineChoice::Cpu => false,
        EngineChoice::Gpu => true,
        EngineChoice::Auto => args.adapter.is_some() || has_hardware(),
    }
}

#[cfg(feature = "gpu")]
fn has_hardware() -> bool {
    let adapters = pollster::block_on(mte_slam_core::engine::list_adapters());
    adapters.iter().any(|a| a.missing.is_empty() && is_hardware(&a.device_type))
}

#[cfg(not(feature = "gpu"))]
fn has_hardware() -> bool {
    false
}

/// Why `auto` passes over the adapters, when all that can be used are software.
#[cfg(feature = "gpu")]
fn only_software() -> Option<String> {
    let adapters = pollster::block_on(mte_slam_core::engine::list_adapters());
    let usable: Vec<_> = adapters.iter().filter(|a| a.missing.is_empty()).collect();
    if usable.is_empty() || usable.iter().any(|a| is_hardware(&a.device_type)) {
        return None;
    }
    Some(format!("{} is a software adapter; --engine gpu takes it", usable[0].name))
}

#[cfg(not(feature = "gpu"))]
fn only_software() -> Option<String> {
    None
}

#[cfg(feature = "gpu")]
fn start_gpu(adapter: Option<&str>) -> Result<Engine, String> {
    let options = mte_slam_core::engine::GpuOptions {
        adapter_name: adapter.map(str::to_owned),
        ..Default::default()
    };
    pollster::block_on(Engine::gpu(options)).map_err(|e| e.to_string())
}

#[cfg(not(feature = "gpu"))]
fn start_gpu(_adapter: Option<&str>) -> Result<Engine, String> {
    Err("this program was built without graphics adapters (feature `gpu`)".to_owned())
}

fn describe(engine: Engine, why: String) -> StartedEngine {
    let info = engine.info();
    let note = if info.kind == "cpu" {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        format!("computing on the processor ({}, {threads} threads){why}", info.adapter)
    } else {
        format!("computing on {} ({})", info.adapter, info.backend)
    };
    let record = EngineRecord {
        kind: info.kind.to_owned(),
        adapter: info.adapter,
        backend: info.backend,
        driver: info.driver,
    };
    StartedEngine { engine, record, note }
}
