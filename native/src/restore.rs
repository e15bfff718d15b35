//! A finished run's map again, and the mesh of a map.
use crate::{args::EngineArgs, engine, output::checkpoint, screen::Screen};
use anyhow::{Context, Result};
use mte_slam_core::slam::Slam;
use mte_slam_mesh::Mesh;
use pollster::block_on;
use std::path::Path;

/// Restores the map of an output folder's checkpoint.
pub fn restore(out: &Path, engine: &EngineArgs, screen: Screen) -> Result<Slam> {
    let path = out.join("checkpoint.safetensors");
    let saved = checkpoint::read_file(&path)?;
    let started = engine::start(engine)?;
    let slam = block_on(Slam::restore(started.engine, &saved))
        .with_context(|| format!("{}: the map cannot be restored", path.display()))?;
    screen.note(&format!("{}: {}", slam.info().name, started.note));
    Ok(slam)
}

/// Extracts the mesh of the map, with progress.
pub fn extract_mesh(slam: &mut Slam, resolution_m: f64, screen: Screen) -> Result<Mesh> {
    let mut progress = screen.progress("meshing", 100);
    let mesh = block_on(slam.extract_mesh(resolution_m, &mut |part| {
        progress.set((part * 100.0) as u64, String::new);
    }))
    .context("the mesh cannot be extracted")?;
    progress.finish();
    Ok(mesh)
}
