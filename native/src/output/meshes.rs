//! Mesh files.
use anyhow::{Context, Result};
use mte_slam_mesh::{Mesh, write_glb, write_glb_by_class, write_ply, write_ply_by_class};
use mte_slam_report::draw::pictures::unlabelled_id;
use mte_slam_types::classes::ClassTable;

/// `mesh.ply` and `mesh.glb` with colours and, with classes, `mesh_semantic.ply` (the classes'
/// colours and raw ids) and `mesh_semantic.glb` (one material per class), given to `write` with their
/// names.
pub fn write(
    mesh: &Mesh,
    table: &ClassTable,
    write: &mut dyn FnMut(&str, &[u8]) -> Result<()>,
) -> Result<()> {
    let failed = "the mesh cannot be written";
    write("mesh.ply", &write_ply(mesh).context(failed)?)?;
    write("mesh.glb", &write_glb(mesh).context(failed)?)?;
    if !table.is_empty() && mesh.classes.len() == mesh.positions.len() {
        let ply = write_ply_by_class(mesh, table, unlabelled_id(table)).context(failed)?;
        write("mesh_semantic.ply", &ply)?;
        write("mesh_semantic.glb", &write_glb_by_class(mesh, table).context(failed)?)?;
    }
    Ok(())
}
