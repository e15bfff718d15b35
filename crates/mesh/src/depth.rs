//! Depth of one mesh from many poses. Each view is rendered by one thread, so that callers can go
//! through their views in parallel, and needs no memory but its image.
use super::{
    Mesh,
    raster::{NEAR_M, Vertex, draw, project},
    to_dvec3,
};
use alloc::{vec, vec::Vec};
use core::cmp::Ordering;
use glam::DVec3;
use mte_slam_types::{camera::Camera, pose::Pose};

/// Triangles that are passed over together. Neighbours in a mesh's list are mostly neighbours in
/// space (marching cubes and scanners write them so), which makes their box small.
const RUN: usize = 512;

/// Renders depth of a mesh, both sides of its triangles.
pub struct DepthRenderer<'a> {
    mesh: &'a Mesh,
    /// Smallest and largest corner of each run of triangles.
    boxes: Vec<[DVec3; 2]>,
}

impl<'a> DepthRenderer<'a> {
    /// Prepares a mesh whose vertex indices are in range ([`Mesh::check`]).
    pub fn new(mesh: &'a Mesh) -> DepthRenderer<'a> {
        let around = |run: &[[u32; 3]]| {
            let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            run.iter().flatten().fold(none, |[low, high], &i| {
                let p = mesh.point(i);
                [low.min(p), high.max(p)]
            })
        };
        DepthRenderer { mesh, boxes: mesh.triangles.chunks(RUN).map(around).collect() }
    }

    /// Returns depth along z \[m\] at the pixels' centres, row-major; 0 where no surface is nearer than
    /// `far_m`.
    pub fn depth_m(&self, camera: &Camera, world_from_camera: &Pose, far_m: f64) -> Vec<f32> {
        let camera_from_world = world_from_camera.inverse();
        let width = camera.width as usize;
        let mut pixels = vec![(0f32, u32::MAX); camera.pixels()];
        for (run, bounds) in self.boxes.iter().enumerate() {
            if !may_be_in_view(camera, &camera_from_world, bounds, far_m) {
                continue;
            }
            let first = run * RUN;
            let end = (first + RUN).min(self.mesh.triangles.len());
            for t in first..end {
                let corners = self.mesh.triangles[t].map(|i| {
                    let p = to_dvec3(self.mesh.positions[i as usize]);
                    Vertex::new(camera, camera_from_world.transform_point(p))
                });
                let [a, b, c] = &corners;
                project([a, b, c], t as u32, camera, &mut |p| draw(&p, 0, width, &mut pixels));
            }
        }
        // The buffer holds 1 / depth.
        let least = (1.0 / far_m) as f32;
        let depth = |(inverse, _): (f32, u32)| {
            if inverse > 0.0 && inverse >= least { inverse.recip() } else { 0.0 }
        };
        pixels.into_iter().map(depth).collect()
    }
}

/// False only where a whole box is outside one side of the frustum.
fn may_be_in_view(
    camera: &Camera,
    camera_from_world: &Pose,
    [low, high]: &[DVec3; 2],
    far_m: f64,
) -> bool {
    let corners: [DVec3; 8] = core::array::from_fn(|i| {
        let pick = |bit: usize, l: f64, h: f64| if i >> bit & 1 == 1 { h } else { l };
        let p = DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
        camera_from_world.transform_point(p)
    });
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    // Each is positive inside; half a pixel beyond the outermost centres is kept.
    let sides: [&dyn Fn(DVec3) -> f64; 6] = [
        &|p| p.z - NEAR_M,
        &|p| far_m - p.z,
        &|p| camera.fx * p.x + (camera.cx + 0.5) * p.z,
        &|p| (w - 0.5 - camera.cx) * p.z - camera.fx * p.x,
        &|p| camera.fy * p.y + (camera.cy + 0.5) * p.z,
        &|p| (h - 0.5 - camera.cy) * p.z - camera.fy * p.y,
    ];
    // A box with a NaN is looked at triangle by triangle.
    let outside = |distance: f64| distance.partial_cmp(&0.0) == Some(Ordering::Less);
    sides.iter().all(|side| corners.iter().any(|&p| !outside(side(p))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{rasterise, test_shapes::square};

    const CAMERA: Camera = Camera { width: 80, height: 60, fx: 70.0, fy: 72.0, cx: 39.5, cy: 29.5 };

    #[test]
    fn depth_is_that_of_the_rasteriser_from_anywhere() {
        // Two crossing fields of many runs.
        let mut mesh = square(90, 12.0, 0.0);
        let mut wall = square(60, 9.0, 0.0);
        wall.positions.iter_mut().for_each(|p| *p = [p[2] + 4.0, p[0] + 1.0, p[1] - 3.0]);
        let offset = mesh.positions.len() as u32;
        mesh.positions.extend(&wall.positions);
        mesh.triangles.extend(wall.triangles.iter().map(|t| t.map(|i| i + offset)));
        let renderer = DepthRenderer::new(&mesh);
        let (mut seen, mut empty) = (0, 0);
        for k in 0..40 {
            let k = f64::from(k);
            let twist = [3.0 + k * 0.1, 5.0, 1.0 - 0.06 * k, 0.7 * k, 0.3 * k, 0.9 * k];
            let pose = Pose::from_twist(&twist);
            let expected = rasterise(&mesh, &CAMERA, &pose).depth_m;
            assert_eq!(renderer.depth_m(&CAMERA, &pose, f64::INFINITY), expected, "{k}");
            for (near, all) in renderer.depth_m(&CAMERA, &pose, 3.0).iter().zip(&expected) {
                assert_eq!(*near, if *all <= 3.0 { *all } else { 0.0 });
            }
            seen += expected.iter().filter(|d| **d > 0.0).count();
            empty += expected.iter().filter(|d| **d == 0.0).count();
        }
        assert!(seen > 30_000 && empty > 30_000, "{seen} {empty}");
    }
}
