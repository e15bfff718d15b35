//! `mte-slam shaders`.
use crate::{args::ShadersArgs, output::folder::replace_file, screen::Screen};
use anyhow::{Context, Result};
use mte_slam_core::{kernels, shader};

/// Writes every composed shader to a folder.
pub fn run(args: &ShadersArgs, screen: Screen) -> Result<()> {
    // All are composed before the first is written.
    let mut shaders = Vec::new();
    for kernel in kernels::all() {
        let text = shader::compose(kernel.interface, &[])
            .with_context(|| format!("shader {} cannot be composed", kernel.interface.name))?;
        shaders.push((format!("{}.wgsl", kernel.interface.name), text));
    }
    for (name, text) in &shaders {
        replace_file(&args.dir.join(name), text.as_bytes())?;
    }
    let names: Vec<&String> = shaders.iter().map(|(name, _)| name).collect();
    let json = serde_json::json!({ "folder": args.dir, "files": names });
    let text = format!("{} shaders written to {}\n", names.len(), args.dir.display());
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}
