//! `mte-slam bench`.
use crate::{args::BenchArgs, screen::Screen};
use anyhow::Result;

/// Write every composed shader to a folder.
pub fn run(_args: &BenchArgs, _screen: Screen) -> Result<()> {
    anyhow::bail!("no bench yet")
}
