//! `mte-slam synth`.
use crate::{args::SynthArgs, screen::Screen};
use anyhow::Result;

/// Write every composed shader to a folder.
pub fn run(_args: &SynthArgs, _screen: Screen) -> Result<()> {
    anyhow::bail!("no synth yet")
}
