//! `objects.glb`.
use crate::{error::ObjectsError, objects::Objects};
use mte_slam_mesh::{GlbExtra, GlbNode, Mesh, write_glb_nodes};

/// Returns a GLB with one node per object, named as the object, with its own vertices. `extras` of a
/// node have `id` (place in `objects.json`), `class_id`, `class` and `structure`. Colors are the
/// mesh's. Triangles without an object are left out.
///
/// # Errors
/// A mesh other than the one that the objects were made of, or 4 GiB of data.
pub fn write_objects_glb(mesh: &Mesh, objects: &Objects) -> Result<Vec<u8>, ObjectsError> {
    // Checks that the mesh is the one.
    objects.vertex_object(mesh)?;
    let mut triangles = vec![Vec::new(); objects.objects.len()];
    for (t, &object) in objects.face_object.iter().enumerate() {
        if let Some(list) = triangles.get_mut(object as usize) {
            list.push(t as u32);
        }
    }
    let nodes: Vec<GlbNode<'_>> = objects
        .objects
        .iter()
        .zip(&triangles)
        .enumerate()
        .map(|(id, (object, triangles))| GlbNode {
            name: &object.name,
            triangles,
            extras: vec![
                ("id", GlbExtra::Number(id as f64)),
                ("class_id", GlbExtra::Number(f64::from(object.class_id))),
                ("class", GlbExtra::Text(&object.class_name)),
                ("structure", GlbExtra::Flag(object.structure)),
            ],
        })
        .collect();
    Ok(write_glb_nodes(mesh, &nodes)?)
}
