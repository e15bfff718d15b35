//! The 256 cases of marching cubes, derived rather than typed in.
//!
//! Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge `4 a + k` runs along axis a
//! from its base corner (bit a clear; the other two bits, in order of the axes, are k).
use alloc::vec::Vec;

/// Base corner of each edge; the other end is `base | 1 << (edge / 4)`.
pub(crate) const EDGE_BASE: [u8; 12] = [0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3];

/// Corners of the six faces (axis and side: x0 x1 y0 y1 z0 z1), counter-clockwise seen from outside.
const FACES: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Returns the edge between two corners that differ in one bit.
fn edge_between(a: u8, b: u8) -> usize {
    let (axis, base) = ((a ^ b).trailing_zeros() as usize, a & b);
    (axis * 4..axis * 4 + 4).find(|&e| EDGE_BASE[e] == base).unwrap_or(0)
}

/// Triangles of every case as triples of edges; bit c of the case is set where corner c is
/// inside (negative distance).
pub(crate) fn triangle_tables() -> Vec<Vec<[u8; 3]>> {
    (0..=255).map(triangles_of_case).collect()
}

/// Each cut edge belongs to two faces. Walking round a face, the surface leads from where a
/// run of inside corners begins to where it ends: four-cut faces are thus always split so that inside
/// corners stay apart, a choice that depends on the face alone, so neighbours agree and no
/// cracks open. As the two faces of an edge are walked in opposite senses, "next edge" is a
/// permutation of the cut edges, and its cycles are the surface's polygons.
fn triangles_of_case(case: u8) -> Vec<[u8; 3]> {
    let inside = |corner: u8| case >> corner & 1 == 1;
    let mut next = [usize::MAX; 12];
    let mut faces_of_edge = [0u8; 12];
    for (f, corners) in FACES.iter().enumerate() {
        let corner = |i: usize| corners[i % 4];
        for i in 0..4 {
            faces_of_edge[edge_between(corner(i), corner(i + 1))] |= 1 << f;
            if inside(corner(i)) || !inside(corner(i + 1)) {
                continue;
            }
            let mut j = i + 1;
            while inside(corner(j + 1)) {
                j += 1;
            }
            next[edge_between(corner(i), corner(i + 1))] = edge_between(corner(j), corner(j + 1));
        }
    }
    let mut triangles = Vec::new();
    let mut used = [false; 12];
    for first in 0..12 {
        let mut polygon = Vec::new();
        let mut edge = first;
        while next[edge] != usize::MAX && !used[edge] {
            used[edge] = true;
            polygon.push(edge as u8);
            edge = next[edge];
        }
        fan(&polygon, &faces_of_edge, &mut triangles);
    }
    triangles
}

/// Triangulates a polygon as the fan with the fewest diagonals inside a face of the cell: the
/// neighbour might have the same diagonal, and the edge would then join four triangles.
fn fan(polygon: &[u8], faces_of_edge: &[u8; 12], triangles: &mut Vec<[u8; 3]>) {
    let n = polygon.len();
    if n < 3 {
        return;
    }
    let at = |apex: usize, i: usize| polygon[(apex + i) % n];
    let faces = |e: u8| faces_of_edge[e as usize];
    let flat_diagonals = |&apex: &usize| {
        (2..n - 1).filter(|&i| faces(at(apex, 0)) & faces(at(apex, i)) != 0).count()
    };
    let apex = (0..n).min_by_key(flat_diagonals).unwrap_or(0);
    triangles.extend((1..n - 1).map(|i| [at(apex, 0), at(apex, i), at(apex, i + 1)]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::collections::BTreeMap;

    #[test]
    fn every_case_is_a_closed_cut_without_flat_diagonals() {
        let mut faces_of_edge = [0u8; 12];
        for (f, c) in FACES.iter().enumerate() {
            for i in 0..4 {
                faces_of_edge[edge_between(c[i], c[(i + 1) % 4])] |= 1 << f;
            }
        }
        for (case, triangles) in triangle_tables().iter().enumerate() {
            // Every cut edge is used and no other.
            for e in 0..12u8 {
                let base = EDGE_BASE[e as usize];
                let end = base | 1 << (e / 4);
                let cut = (case >> base & 1) != (case >> end & 1);
                assert_eq!(cut, triangles.iter().flatten().any(|&x| x == e), "case {case}");
            }
            // Sides used once lie in a face; sides used twice, in opposite senses, do not.
            let mut sides: BTreeMap<(u8, u8), i32> = BTreeMap::new();
            let mut uses: BTreeMap<(u8, u8), i32> = BTreeMap::new();
            for t in triangles {
                for i in 0..3 {
                    let (a, b) = (t[i], t[(i + 1) % 3]);
                    *sides.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
                    *uses.entry((a.min(b), a.max(b))).or_default() += 1;
                }
            }
            for (side, n) in uses {
                let flat = faces_of_edge[side.0 as usize] & faces_of_edge[side.1 as usize] != 0;
                assert_eq!(n, if flat { 1 } else { 2 }, "case {case} side {side:?}");
                assert_eq!(sides[&side].abs(), if flat { 1 } else { 0 }, "case {case}");
            }
        }
    }
}
