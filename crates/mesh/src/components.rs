//! Connected parts of a mesh, and dropping the small ones (floaters of a learned field).
use super::Mesh;
use alloc::{vec, vec::Vec};

/// When a connected part is too small to keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ComponentSize {
    /// Fewer than this many triangles.
    Triangles(usize),
    /// Less than this area \[m2\].
    Area(f64),
}

/// Returns the connected parts, as lists of triangle indices, ordered by their first triangle. Triangles
/// are connected when they share a vertex.
pub fn components(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    fn root(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    for t in &mesh.triangles {
        let a = root(&mut parent, t[0]);
        let b = root(&mut parent, t[1]);
        let c = root(&mut parent, t[2]);
        let lowest = a.min(b).min(c);
        for i in [a, b, c] {
            parent[i as usize] = lowest;
        }
    }
    let mut part_of_root = vec![u32::MAX; mesh.positions.len()];
    let mut parts: Vec<Vec<u32>> = Vec::new();
    for (i, t) in mesh.triangles.iter().enumerate() {
        let part = &mut part_of_root[root(&mut parent, t[0]) as usize];
        if *part == u32::MAX {
            *part = parts.len() as u32;
            parts.push(Vec::new());
        }
        parts[*part as usize].push(i as u32);
    }
    parts
}

impl Mesh {
    /// Drops connected parts below a size. Returns how many were dropped.
    pub fn remove_small_components(&mut self, smaller_than: ComponentSize) -> usize {
        let mut keep = vec![false; self.triangles.len()];
        let mut dropped = 0;
        for part in components(self) {
            let small = match smaller_than {
                ComponentSize::Triangles(n) => part.len() < n,
                ComponentSize::Area(area) => {
                    part.iter().map(|&t| self.triangle_area(t as usize)).sum::<f64>() < area
                }
            };
            dropped += usize::from(small);
            part.iter().for_each(|&t| keep[t as usize] = !small);
        }
        self.retain_triangles(|t| keep[t]);
        dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;

    #[test]
    fn small_parts_go() {
        let mut mesh = square(10, 1.0, 0.0);
        for (n, z) in [(3, 1.0), (1, 2.0)] {
            let other = square(n, 0.1 * n as f32, z);
            let offset = mesh.positions.len() as u32;
            mesh.positions.extend(other.positions);
            mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + offset)));
        }
        let sizes: Vec<usize> = components(&mesh).iter().map(Vec::len).collect();
        assert_eq!(sizes, [200, 18, 2]);
        let mut by_area = mesh.clone();
        assert_eq!(by_area.remove_small_components(ComponentSize::Area(0.05)), 1);
        assert_eq!(by_area.triangles.len(), 218);
        assert_eq!(mesh.remove_small_components(ComponentSize::Triangles(19)), 2);
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (200, 121));
    }
}
