//! PLY bytes of a mesh.
use super::{Mesh, MeshError};
use alloc::{format, string::String, vec::Vec};

/// Binary little-endian PLY: x y z, then nx ny nz, red green blue (uchar) and class (uchar) as
/// far as the mesh has them, and triangular faces (`vertex_indices`).
///
/// # Errors
/// A mesh that fails [`Mesh::check`].
pub fn write_ply(mesh: &Mesh) -> Result<Vec<u8>, MeshError> {
    mesh.check()?;
    let n = mesh.positions.len();
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    let mut row = 12;
    header += &format!("element vertex {n}\n");
    header += "property float x\nproperty float y\nproperty float z\n";
    if !mesh.normals.is_empty() {
        header += "property float nx\nproperty float ny\nproperty float nz\n";
        row += 12;
    }
    if !mesh.colors.is_empty() {
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
        row += 3;
    }
    if !mesh.classes.is_empty() {
        header += "property uchar class\n";
        row += 1;
    }
    header += &format!("element face {}\n", mesh.triangles.len());
    header += "property list uchar int vertex_indices\nend_header\n";
    let mut out = Vec::with_capacity(header.len() + n * row + mesh.triangles.len() * 13);
    out.extend_from_slice(header.as_bytes());
    let floats = |out: &mut Vec<u8>, values: [f32; 3]| {
        values.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    };
    for i in 0..n {
        floats(&mut out, mesh.positions[i]);
        if let Some(&normal) = mesh.normals.get(i) {
            floats(&mut out, normal);
        }
        if let Some(color) = mesh.colors.get(i) {
            out.extend_from_slice(color);
        }
        out.extend(mesh.classes.get(i));
    }
    for t in &mesh.triangles {
        out.push(3);
        t.iter().for_each(|i| out.extend_from_slice(&i.to_le_bytes()));
    }
    Ok(out)
}
