//! PLY bytes of a mesh.
use super::{Mesh, MeshError};
use alloc::{format, string::String, vec::Vec};
use mte_slam_types::classes::ClassTable;

/// Binary little-endian PLY: x y z, then nx ny nz, red green blue (uchar) and class (uchar, the
/// compact index) as far as the mesh has them, and triangular faces (`vertex_indices`).
///
/// # Errors
/// A mesh that fails [`Mesh::check`].
pub fn write_ply(mesh: &Mesh) -> Result<Vec<u8>, MeshError> {
    mesh.check()?;
    let comments = String::new();
    Ok(bytes(mesh, &comments, mesh.colors.get(..), "uchar", |i, out| {
        out.extend(mesh.classes.get(i))
    }))
}

/// Returns the same with each vertex in its class's colour (black without one) and its raw id as `class`
/// (ushort): `unlabelled` where it has none. Comments name the ids.
///
/// # Errors
/// A mesh that fails [`Mesh::check`] or has no classes.
pub fn write_ply_by_class(
    mesh: &Mesh,
    table: &ClassTable,
    unlabelled: u16,
) -> Result<Vec<u8>, MeshError> {
    mesh.check()?;
    if mesh.classes.len() != mesh.positions.len() {
        let (found, expected) = ("none".into(), "one a vertex".into());
        return Err(MeshError::Invalid { what: "classes of the mesh", found, expected });
    }
    let class = |i: usize| table.classes.get(usize::from(mesh.classes[i]));
    let mut comments = format!("comment class {unlabelled} (none)\n");
    for c in &table.classes {
        // The header is ASCII, one line per comment.
        let name = c.name.chars().map(|c| if c.is_ascii_graphic() { c } else { ' ' });
        comments += &format!("comment class {} {}\n", c.raw_id, name.collect::<String>());
    }
    let colors: Vec<[u8; 3]> =
        (0..mesh.positions.len()).map(|i| class(i).map_or([0; 3], |c| c.color)).collect();
    Ok(bytes(mesh, &comments, Some(&colors), "ushort", |i, out| {
        out.extend(class(i).map_or(unlabelled, |c| c.raw_id).to_le_bytes());
    }))
}

fn bytes(
    mesh: &Mesh,
    comments: &str,
    colors: Option<&[[u8; 3]]>,
    class_type: &str,
    write_class: impl Fn(usize, &mut Vec<u8>),
) -> Vec<u8> {
    let colors = colors.unwrap_or_default();
    let n = mesh.positions.len();
    let mut header = format!("ply\nformat binary_little_endian 1.0\n{comments}");
    let mut row = 12;
    header += &format!("element vertex {n}\n");
    header += "property float x\nproperty float y\nproperty float z\n";
    if !mesh.normals.is_empty() {
        header += "property float nx\nproperty float ny\nproperty float nz\n";
        row += 12;
    }
    if !colors.is_empty() {
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
        row += 3;
    }
    if !mesh.classes.is_empty() {
        header += &format!("property {class_type} class\n");
        row += 2;
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
        if let Some(color) = colors.get(i) {
            out.extend_from_slice(color);
        }
        if !mesh.classes.is_empty() {
            write_class(i, &mut out);
        }
    }
    for t in &mesh.triangles {
        out.push(3);
        t.iter().for_each(|i| out.extend_from_slice(&i.to_le_bytes()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;
    use alloc::vec;
    use mte_slam_types::classes::Class;

    #[test]
    fn classes_are_raw_ids_in_their_colours() {
        let class = |raw_id, name: &str| Class { raw_id, name: name.into(), color: [1, 2, 3] };
        let table = ClassTable { classes: vec![class(7, "bed\nend_header"), class(300, "cup")] };
        let mut mesh = square(1, 1.0, 0.0);
        assert!(write_ply_by_class(&mesh, &table, 0).is_err());
        mesh.classes = vec![0, 1, 255, 9];
        let ply = write_ply_by_class(&mesh, &table, 65535).unwrap();
        let end = ply.windows(12).position(|w| w == b"\nend_header\n").unwrap() + 12;
        let header = core::str::from_utf8(&ply[..end]).unwrap();
        assert!(header.contains("comment class 7 bed end_header\n"), "{header}");
        assert!(header.contains("property ushort class\n"), "{header}");
        let rows: Vec<&[u8]> = ply[end..].chunks_exact(12 + 3 + 2).take(4).collect();
        let ids: Vec<u16> = rows.iter().map(|r| u16::from_le_bytes([r[15], r[16]])).collect();
        assert_eq!(ids, [7, 300, 65535, 65535]);
        assert_eq!((&rows[0][12..15], &rows[2][12..15]), (&[1u8, 2, 3][..], &[0u8; 3][..]));
        assert_eq!(ply.len(), end + 4 * 17 + 2 * 13);
    }
}
