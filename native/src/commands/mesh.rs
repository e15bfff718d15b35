//! `mte-slam mesh`.
use crate::{
    args::MeshArgs,
    engine,
    output::{checkpoint, folder::replace_file, meshes},
    pipeline::extract_mesh,
    screen::Screen,
};
use anyhow::{Context, Result};
use mte_slam_core::slam::Slam;
use pollster::block_on;

/// Extract the mesh of a checkpoint.
pub fn run(args: &MeshArgs, screen: Screen) -> Result<()> {
    let saved = checkpoint::read_file(&args.out.join("checkpoint.safetensors"))?;
    let described = checkpoint::described(&saved)?;
    let chosen = engine::start(&args.engine)?;
    screen.note(&format!("{}: {}", described.name, chosen.note));
    let mut slam = block_on(Slam::restore(chosen.engine, &saved))
        .with_context(|| format!("{}: the map cannot be restored", args.out.display()))?;
    let mesh = extract_mesh(&mut slam, args.resolution, screen)?;
    let mut names = Vec::new();
    meshes::write(&mesh, &described.classes, &mut |name, bytes| {
        names.push(args.out.join(name).display().to_string());
        replace_file(&args.out.join(name), bytes)
    })?;
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    let json = serde_json::json!({
        "resolution_m": args.resolution,
        "vertices": vertices,
        "triangles": triangles,
        "files": names,
    });
    let text = format!(
        "{vertices} vertices, {triangles} triangles at {} m: {}\n",
        args.resolution,
        names.join(", ")
    );
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}
