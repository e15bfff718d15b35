//! What computes.
use clap::{Args, ValueEnum};

/// Which engine computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum EngineChoice {
    /// A hardware graphics adapter if there is one, else the processor (which beats software
    /// adapters such as llvmpipe).
    #[default]
    Auto,
    /// A graphics adapter (Vulkan, Metal or DirectX 12); an error without one.
    Gpu,
    /// The processor: the kernels' Rust twins on all cores.
    Cpu,
}

/// Engine options.
#[derive(Clone, Debug, Default, Args)]
pub struct EngineArgs {
    /// What computes.
    #[arg(long, value_enum, default_value_t, value_name = "ENGINE", help_heading = "Engine")]
    pub engine: EngineChoice,
    /// Take the adapter whose name contains this text (see `mte-slam info`).
    #[arg(long, value_name = "NAME", help_heading = "Engine")]
    pub adapter: Option<String>,
}
