//! `mte-slam info`.
use crate::{args::InfoArgs, screen::Screen};
use anyhow::Result;

/// Write every composed shader to a folder.
pub fn run(_args: &InfoArgs, _screen: Screen) -> Result<()> {
    anyhow::bail!("no info yet")
}
