//! `mte-slam mesh`.
use crate::{
    args::MeshArgs,
    output::{folder::replace_file, meshes},
    restore::{extract_mesh, restore},
    screen::Screen,
    views::shown_classes,
};
use anyhow::Result;

/// Extracts the mesh of a checkpoint.
pub fn run(args: &MeshArgs, screen: Screen) -> Result<()> {
    let mut slam = restore(&args.out, &args.engine, screen)?;
    let mesh = extract_mesh(&mut slam, args.resolution, screen)?;
    let mut names = Vec::new();
    meshes::write(&mesh, &shown_classes(&slam), &mut |name, bytes| {
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
