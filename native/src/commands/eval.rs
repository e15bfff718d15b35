//! `mte-slam eval`.
use crate::{args::EvalArgs, screen::Screen};
use anyhow::Result;

/// Write every composed shader to a folder.
pub fn run(_args: &EvalArgs, _screen: Screen) -> Result<()> {
    anyhow::bail!("no eval yet")
}
