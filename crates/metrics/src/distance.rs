//! Distances of points to a mesh, for pictures of errors.
use super::bvh::{NearestBvh, triangles};
use alloc::vec::Vec;
use mte_slam_mesh::{Mesh, to_dvec3};
use mte_slam_types::parallel;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Exact distance of each point to the nearest triangle of `mesh` \[m\], `limit_m` where there is
/// none nearer than that.
///
/// # Panics
/// An index of a triangle out of range: see [`Mesh::check`].
pub fn distances_to_surface(points: &[[f32; 3]], mesh: &Mesh, limit_m: f64) -> Vec<f32> {
    let tree = NearestBvh::new(&triangles(mesh));
    parallel::map(points.len(), |i| {
        let nearest = tree.nearest(to_dvec3(points[i]), limit_m);
        nearest.map_or(limit_m, |(_, square)| square.sqrt()) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;

    #[test]
    fn distances_are_exact_up_to_the_limit() {
        let mesh = square(3, 2.0, 0.0);
        let points = [[1.0, 1.0, 0.25], [-0.3, 1.0, 0.4], [1.0, 1.0, 7.0], [f32::NAN, 0.0, 0.0]];
        let d = distances_to_surface(&points, &mesh, 1.0);
        assert!((d[0] - 0.25).abs() < 1e-6 && (d[1] - 0.5).abs() < 1e-6, "{d:?}");
        assert_eq!(d[2..], [1.0, 1.0]);
    }
}
