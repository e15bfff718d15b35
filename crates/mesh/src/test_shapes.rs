//! What several tests of meshes need.
use super::Mesh;
use alloc::{collections::BTreeMap, vec, vec::Vec};
use glam::DVec3;
use mte_slam_types::frame::Bounds;

/// What a closed surface is judged by.
pub(crate) struct Topology {
    /// Vertices - edges + faces.
    pub euler: i64,
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Edges of more than two triangles, or of two that wind differently.
    pub bad_edges: usize,
    /// Connected parts.
    pub components: usize,
}

/// Counts edges, and how they are shared.
pub(crate) fn topology(mesh: &Mesh) -> Topology {
    let mut edges: BTreeMap<(u32, u32), (u32, i32)> = BTreeMap::new();
    for t in &mesh.triangles {
        for i in 0..3 {
            let (a, b) = (t[i], t[(i + 1) % 3]);
            let e = edges.entry((a.min(b), a.max(b))).or_default();
            e.0 += 1;
            e.1 += if a < b { 1 } else { -1 };
        }
    }
    Topology {
        euler: mesh.positions.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64,
        boundary_edges: edges.values().filter(|e| e.0 == 1).count(),
        bad_edges: edges.values().filter(|e| e.0 > 2 || (e.0 == 2 && e.1 != 0)).count(),
        components: super::components(mesh).len(),
    }
}

/// Returns a cube about the origin.
pub(crate) fn cube_bounds(half_m: f64) -> Bounds {
    Bounds { min: DVec3::splat(-half_m), max: DVec3::splat(half_m) }
}

/// Returns a flat square at height z, facing +z, `n` x `n` cells from (0, 0) to (size, size).
pub(crate) fn square(n: u32, size: f32, z: f32) -> Mesh {
    let at = |i: u32| i as f32 / n as f32 * size;
    let mut positions: Vec<[f32; 3]> = vec![];
    let mut triangles = vec![];
    for y in 0..=n {
        positions.extend((0..=n).map(|x| [at(x), at(y), z]));
    }
    for y in 0..n {
        for x in 0..n {
            let a = y * (n + 1) + x;
            triangles.push([a, a + 1, a + n + 2]);
            triangles.push([a, a + n + 2, a + n + 1]);
        }
    }
    Mesh { positions, triangles, ..Mesh::default() }
}
