//! Mesh chunks as bytes that a renderer uploads as they are.
use crate::message::ChunkData;
use mte_slam_core::slam::MeshChunk;
use mte_slam_types::classes::UNLABELLED;

/// Bytes a vertex.
pub const VERTEX_BYTES: usize = 20;

/// See [`ChunkData`] for the layout.
pub fn chunk(chunk: &MeshChunk) -> ChunkData {
    let mesh = &chunk.mesh;
    let mut vertices = Vec::with_capacity(mesh.positions.len() * VERTEX_BYTES);
    for (i, p) in mesh.positions.iter().enumerate() {
        vertices.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        let n = mesh.normals.get(i).copied().unwrap_or_default();
        vertices.extend(n.map(|x| (x.clamp(-1.0, 1.0) * 127.0).round() as i8 as u8));
        vertices.push(0);
        vertices.extend(mesh.colors.get(i).copied().unwrap_or([200; 3]));
        vertices.push(mesh.classes.get(i).copied().unwrap_or(UNLABELLED));
    }
    let indices = mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    let [x, y, z] = chunk.key;
    ChunkData { key: format!("{x},{y},{z}"), vertices, indices }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_mesh::Mesh;

    #[test]
    fn a_vertex_has_its_bytes_in_order() {
        let mesh = Mesh {
            positions: vec![[1.0, -2.0, 0.5]],
            normals: vec![[0.0, -1.0, 1.0]],
            colors: vec![[9, 8, 7]],
            classes: vec![4],
            triangles: vec![[0, 0, 0]],
        };
        let packed = chunk(&MeshChunk { key: [1, -2, 3], mesh });
        assert_eq!(packed.key, "1,-2,3");
        assert_eq!(packed.vertices.len(), VERTEX_BYTES);
        assert_eq!(packed.vertices[..4], 1f32.to_le_bytes());
        assert_eq!(packed.vertices[12..], [0, 129, 127, 0, 9, 8, 7, 4]);
        assert_eq!(packed.indices.len(), 12);
    }
}
