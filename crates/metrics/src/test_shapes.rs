//! A surface of known area for tests.
use alloc::{vec, vec::Vec};
use mte_slam_mesh::Mesh;

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
