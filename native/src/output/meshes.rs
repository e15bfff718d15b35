//! Mesh files.
use anyhow::{Context, Result};
use mte_slam_core::{
    classes::ClassTable,
    mesh::{Mesh, write_glb, write_ply},
};

/// `mesh.ply` and `mesh.glb` with colours and, with classes, `mesh_semantic.ply` in the classes'
/// colours, given to `write` with their names.
pub fn write(
    mesh: &Mesh,
    table: &ClassTable,
    write: &mut dyn FnMut(&str, &[u8]) -> Result<()>,
) -> Result<()> {
    let failed = "the mesh cannot be written";
    write("mesh.ply", &write_ply(mesh).context(failed)?)?;
    write("mesh.glb", &write_glb(mesh).context(failed)?)?;
    if !table.is_empty() && mesh.classes.len() == mesh.positions.len() {
        let mut colored = mesh.clone();
        colored.colors =
            mesh.classes.iter().map(|&c| super::pictures::class_color(c, table)).collect();
        write("mesh_semantic.ply", &write_ply(&colored).context(failed)?)?;
    }
    Ok(())
}
