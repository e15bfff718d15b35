//! `mte-slam shaders`.
use crate::{args::ShadersArgs, screen::Screen};
use anyhow::Result;

/// Write every composed shader to a folder.
pub fn run(_args: &ShadersArgs, _screen: Screen) -> Result<()> {
    anyhow::bail!("no shaders yet")
}
