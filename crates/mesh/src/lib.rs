#![doc = include_str!("../README.md")]
//! # Conventions
//!
//! A mesh lives in the world frame of the poses it was made with \[m\]; triangles wind
//! counter-clockwise seen from the free side (where the signed distance is positive).
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

mod components;
mod cull;
mod depth;
mod glb;
mod marching;
mod ply_read;
mod ply_write;
mod raster;
mod tables;

pub use components::{ComponentSize, components};
pub use cull::{CullProtocol, CullingView, Keep, Visibility, cull, in_any_frustum, observed_part};
pub use depth::DepthRenderer;
pub use glb::{GlbExtra, GlbNode, write_glb, write_glb_by_class, write_glb_nodes};
pub use marching::{Block, BlockMesher};
pub use ply_read::{PlyError, read_ply};
pub use ply_write::{write_ply, write_ply_by_class};
pub use raster::{Raster, rasterise};

use alloc::{string::String, vec, vec::Vec};
use glam::DVec3;
use mte_slam_types::pose::Pose;

/// Why a mesh could not be made or written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// Something has a size or value that cannot be worked with.
    #[error("{what}: found {found}, expected {expected}")]
    Invalid {
        /// What is wrong, for example `resolution`.
        what: &'static str,
        /// What was there.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// Blocks must be added or skipped in the order in which they were issued.
    #[error("block {found} was added or skipped, the next one in order is {expected}")]
    BlockOrder {
        /// Sequence number of the block that was given.
        found: u64,
        /// Sequence number of the block that is due.
        expected: u64,
    },
}

/// A triangle mesh. `normals`, `colors` and `classes` are each empty or one per vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions in the world frame \[m\].
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the vertices (zero where undefined).
    pub normals: Vec<[f32; 3]>,
    /// sRGB colours of the vertices.
    pub colors: Vec<[u8; 3]>,
    /// Compact class indices of the vertices ([`mte_slam_types::classes::UNLABELLED`] where unknown).
    pub classes: Vec<u8>,
    /// Vertex indices of the triangles, counter-clockwise seen from the free side.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Returns whether indices are in range and attributes are empty or one per vertex.
    pub fn check(&self) -> Result<(), MeshError> {
        let n = self.positions.len();
        let attributes = [
            ("normals of the mesh", self.normals.len()),
            ("colours of the mesh", self.colors.len()),
            ("classes of the mesh", self.classes.len()),
        ];
        for (what, len) in attributes {
            if len != 0 && len != n {
                let (found, expected) = (alloc::format!("{len}"), alloc::format!("0 or {n}"));
                return Err(MeshError::Invalid { what, found, expected });
            }
        }
        match self.triangles.iter().flatten().find(|&&i| i as usize >= n) {
            Some(i) => Err(MeshError::Invalid {
                what: "vertex index of a triangle",
                found: alloc::format!("{i}"),
                expected: alloc::format!("less than {n}"),
            }),
            None => Ok(()),
        }
    }

    /// Returns the position of vertex `i` in double precision \[m\].
    pub fn point(&self, i: u32) -> DVec3 {
        to_dvec3(self.positions[i as usize])
    }

    /// Returns the corners of triangle `t` \[m\].
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|i| self.point(i))
    }

    /// Returns the area of triangle `t` \[m2\].
    pub fn triangle_area(&self, t: usize) -> f64 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(c - a).length() * 0.5
    }

    /// Returns the class of triangle `t`: of most of its vertices, else of its first; `None` where the
    /// mesh has no classes.
    pub fn triangle_class(&self, t: usize) -> Option<u8> {
        let [a, b, c] = self.triangles[t].map(|i| self.classes.get(i as usize).copied());
        if b == c { b } else { a }
    }

    /// Returns the total area \[m2\].
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| self.triangle_area(t)).sum()
    }

    /// Sets `normals` to the area-weighted mean of the adjacent triangles' normals.
    pub fn compute_normals(&mut self) {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t);
            let twice_area = (b - a).cross(c - a);
            for &i in &self.triangles[t] {
                sums[i as usize] += twice_area;
            }
        }
        let unit = |n: DVec3| n.normalize_or_zero().to_array().map(|x| x as f32);
        self.normals = sums.into_iter().map(unit).collect();
    }

    /// Moves the mesh by a rigid transform, for example to the frame of a ground-truth mesh.
    pub fn transform(&mut self, to_from_mesh: &Pose) {
        for p in &mut self.positions {
            *p = to_from_mesh.transform_point(to_dvec3(*p)).to_array().map(|x| x as f32);
        }
        for n in &mut self.normals {
            *n = to_from_mesh.transform_vector(to_dvec3(*n)).to_array().map(|x| x as f32);
        }
    }

    /// Keeps the triangles for which `keep(index)` holds, and drops vertices that none of them
    /// uses. The order of what stays does not change.
    pub fn retain_triangles(&mut self, keep: impl Fn(usize) -> bool) {
        let mut t = 0;
        self.triangles.retain(|_| {
            t += 1;
            keep(t - 1)
        });
        self.drop_unused_vertices();
    }

    /// Drops vertices that no triangle uses.
    pub fn drop_unused_vertices(&mut self) {
        let mut new_index = vec![u32::MAX; self.positions.len()];
        for &i in self.triangles.iter().flatten() {
            new_index[i as usize] = 0;
        }
        for (next, i) in new_index.iter_mut().filter(|i| **i == 0).enumerate() {
            *i = next as u32;
        }
        for i in self.triangles.iter_mut().flatten() {
            *i = new_index[*i as usize];
        }
        keep_used(&mut self.positions, &new_index);
        keep_used(&mut self.normals, &new_index);
        keep_used(&mut self.colors, &new_index);
        keep_used(&mut self.classes, &new_index);
    }
}

fn keep_used<T>(values: &mut Vec<T>, new_index: &[u32]) {
    let mut i = 0;
    values.retain(|_| {
        i += 1;
        new_index[i - 1] != u32::MAX
    });
}

/// Converts a vertex or normal to f64.
pub fn to_dvec3(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

#[cfg(test)]
pub(crate) mod test_shapes;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unused_vertices_go_and_attributes_follow() {
        let mut m = Mesh {
            positions: (0..5).map(|i| [i as f32, (i * i) as f32, 0.0]).collect(),
            colors: (0..5).map(|i| [i; 3]).collect(),
            classes: (0..5).collect(),
            triangles: vec![[0, 1, 2], [4, 2, 1]],
            ..Mesh::default()
        };
        m.compute_normals();
        m.retain_triangles(|t| t == 1);
        m.check().unwrap();
        assert_eq!(m.triangles, [[2, 1, 0]]);
        assert_eq!(m.classes, [1, 2, 4]);
        assert_eq!(m.colors[2], [4; 3]);
        assert_eq!(m.positions[2], [4.0, 16.0, 0.0]);
        m.triangles[0][1] = 3;
        assert!(m.check().is_err());
    }
}
