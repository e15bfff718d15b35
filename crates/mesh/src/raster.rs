//! A small z-buffer rasteriser: what a camera would see of a mesh. Deterministic: the nearest
//! surface wins, the lower triangle index at equal depth.
use super::{Mesh, to_dvec3};
use alloc::vec::Vec;
use glam::DVec3;
use mte_slam_types::parallel;
use mte_slam_types::{camera::Camera, pose::Pose};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Triangles are cut at this depth \[m\].
pub(super) const NEAR_M: f64 = 0.01;
/// Rows drawn by one task.
const BAND_ROWS: usize = 32;
/// Triangles set up by one task.
const CHUNK: usize = 16_384;

/// A rendered view, row-major with the camera's size.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Depth along z \[m\], 0 where nothing is seen.
    pub depth_m: Vec<f32>,
    /// The triangle seen, `u32::MAX` where there is none.
    pub triangle: Vec<u32>,
}

/// A triangle in the image that covers the box of pixels from `low` to `high`.
pub(super) struct Projected {
    /// Pixel positions and 1 / depth.
    corners: [[f32; 3]; 3],
    low: [u32; 2],
    high: [u32; 2],
    triangle: u32,
}

/// A vertex in the camera's frame \[m\] and, if before the near plane, in the image.
pub(super) struct Vertex {
    camera: [f32; 3],
    image: Option<[f32; 3]>,
}

impl Vertex {
    pub(super) fn new(camera: &Camera, p: DVec3) -> Vertex {
        // Not `z < near`: a NaN must not pass.
        let image = (p.z >= NEAR_M).then(|| to_image(camera, p));
        Vertex { camera: p.to_array().map(|x| x as f32), image }
    }
}

/// Pixel position and 1 / depth of a point in the camera's frame.
fn to_image(camera: &Camera, p: DVec3) -> [f32; 3] {
    let inverse = 1.0 / p.z;
    let (u, v) = (camera.fx * p.x * inverse + camera.cx, camera.fy * p.y * inverse + camera.cy);
    [u as f32, v as f32, inverse as f32]
}

/// Renders a mesh, both sides of its triangles.
pub fn rasterise(mesh: &Mesh, camera: &Camera, world_from_camera: &Pose) -> Raster {
    let camera_from_world = world_from_camera.inverse();
    let vertices: Vec<Vertex> = parallel::map(mesh.positions.len(), |i| {
        Vertex::new(camera, camera_from_world.transform_point(to_dvec3(mesh.positions[i])))
    });
    let chunks = mesh.triangles.len().div_ceil(CHUNK);
    let projected: Vec<Vec<Projected>> = parallel::map(chunks, |c| {
        let mut out = Vec::new();
        let end = ((c + 1) * CHUNK).min(mesh.triangles.len());
        for t in c * CHUNK..end {
            let corners = mesh.triangles[t].map(|i| &vertices[i as usize]);
            project(corners, t as u32, camera, &mut |p| out.push(p));
        }
        out
    });
    let width = camera.width as usize;
    let mut pixels = alloc::vec![(0f32, u32::MAX); camera.pixels()];
    parallel::for_chunks(&mut pixels, BAND_ROWS * width, |band, pixels| {
        for p in projected.iter().flatten() {
            draw(p, band * BAND_ROWS, width, pixels);
        }
    });
    // The buffer holds 1 / depth.
    let depth = |&(inverse, _): &(f32, u32)| if inverse > 0.0 { inverse.recip() } else { 0.0 };
    Raster {
        depth_m: pixels.iter().map(depth).collect(),
        triangle: pixels.iter().map(|p| p.1).collect(),
    }
}

/// What of a triangle may be in the image, if anything: given to `out` as up to two triangles.
pub(super) fn project(
    corners: [&Vertex; 3],
    triangle: u32,
    camera: &Camera,
    out: &mut impl FnMut(Projected),
) {
    if let [Some(a), Some(b), Some(c)] = corners.map(|v| v.image) {
        boxed([a, b, c], triangle, camera).into_iter().for_each(out);
    } else if corners.iter().any(|v| v.image.is_some()) {
        cut_at_near_plane(corners, triangle, camera, out);
    }
}

/// What is left of a triangle before the near plane, as one or two triangles.
fn cut_at_near_plane(
    corners: [&Vertex; 3],
    triangle: u32,
    camera: &Camera,
    out: &mut impl FnMut(Projected),
) {
    let mut polygon = [DVec3::ZERO; 4];
    let mut n = 0;
    for i in 0..3 {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        let (a, b) = (to_dvec3(from.camera), to_dvec3(to.camera));
        if from.image.is_some() {
            polygon[n] = a;
            n += 1;
        }
        if from.image.is_some() != to.image.is_some() {
            polygon[n] = a + (b - a) * ((NEAR_M - a.z) / (b.z - a.z));
            n += 1;
        }
    }
    let image = polygon.map(|p| to_image(camera, p));
    (2..n)
        .filter_map(|i| boxed([image[0], image[i - 1], image[i]], triangle, camera))
        .for_each(out);
}

/// Returns the box of pixel centres that a triangle may cover; `None` if there are none, as for most
/// triangles of a fine mesh.
fn boxed(corners: [[f32; 3]; 3], triangle: u32, camera: &Camera) -> Option<Projected> {
    let [a, b, c] = &corners;
    let (mut low, mut high) = ([0; 2], [0; 2]);
    for (axis, size) in [(0, camera.width), (1, camera.height)] {
        let first = a[axis].min(b[axis]).min(c[axis]).ceil().max(0.0);
        let last = a[axis].max(b[axis]).max(c[axis]).floor().min(size as f32 - 1.0);
        if first > last {
            return None;
        }
        (low[axis], high[axis]) = (first as u32, last as u32);
    }
    // `min` and `max` pass over a NaN, so it is looked for here.
    let finite = corners.iter().flatten().all(|x| x.is_finite());
    finite.then_some(Projected { corners, low, high, triangle })
}

/// Draws into rows `first_row..` of the image.
pub(super) fn draw(p: &Projected, first_row: usize, width: usize, pixels: &mut [(f32, u32)]) {
    let end_row = first_row + pixels.len() / width;
    let rows = (p.low[1] as usize).max(first_row)..(p.high[1] as usize + 1).min(end_row);
    if rows.is_empty() {
        return;
    }
    let [a, b, c] = p.corners.map(to_dvec3);
    let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if area == 0.0 {
        return;
    }
    let inverse_area = 1.0 / area;
    for y in rows {
        let v = y as f64 - a.y;
        for x in p.low[0] as usize..p.high[0] as usize + 1 {
            let u = x as f64 - a.x;
            // Barycentric coordinates, with room for rounding so that neighbours leave no gaps.
            let wb = (u * (c.y - a.y) - v * (c.x - a.x)) * inverse_area;
            let wc = ((b.x - a.x) * v - (b.y - a.y) * u) * inverse_area;
            let wa = 1.0 - wb - wc;
            if wa < -1e-7 || wb < -1e-7 || wc < -1e-7 {
                continue;
            }
            // 1 / depth is linear in the image.
            let inverse = (wa * a.z + wb * b.z + wc * c.z) as f32;
            let pixel = &mut pixels[(y - first_row) * width + x];
            if inverse > pixel.0 || (inverse == pixel.0 && p.triangle < pixel.1) {
                *pixel = (inverse, p.triangle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;

    const CAMERA: Camera = Camera { width: 80, height: 60, fx: 70.0, fy: 72.0, cx: 39.5, cy: 29.5 };

    /// A camera inside a tilted plane's half space, and the depth of that plane at a pixel.
    #[test]
    fn a_tilted_plane_is_exact_and_without_holes() {
        // 20 m square through the camera's near plane: exercises cutting at the near plane too.
        let mut mesh = square(7, 20.0, 0.0);
        mesh.transform(&Pose { translation: DVec3::new(-10.0, -10.0, 0.0), ..Pose::IDENTITY });
        let pose = Pose::from_twist(&[0.3, -0.2, -1.5, 0.4, 0.7, 0.2]);
        let image = rasterise(&mesh, &CAMERA, &pose);
        let mut seen = 0;
        for v in 0..60 {
            for u in 0..80 {
                let ray = pose.transform_vector(CAMERA.back_project(u as f64, v as f64, 1.0));
                let depth = -pose.translation.z / ray.z;
                let hit = pose.translation + ray * depth;
                let found = f64::from(image.depth_m[v * 80 + u]);
                if depth > 0.0 && hit.abs().max_element() < 9.99 {
                    assert!((found - depth).abs() < 1e-5 * depth, "{u} {v}: {found} {depth}");
                    assert_ne!(image.triangle[v * 80 + u], u32::MAX);
                    seen += 1;
                } else if depth < 0.0 || hit.abs().max_element() > 10.01 {
                    assert_eq!((found, image.triangle[v * 80 + u]), (0.0, u32::MAX));
                }
            }
        }
        assert!(seen > 3000, "{seen}");
    }

    #[test]
    fn the_nearer_surface_wins_in_any_order() {
        let mut mesh = square(2, 4.0, 3.0);
        let near = square(1, 4.0, 2.0);
        let offset = mesh.positions.len() as u32;
        mesh.positions.extend(near.positions);
        mesh.triangles.extend(near.triangles.iter().map(|t| t.map(|i| i + offset)));
        let pose = Pose { translation: DVec3::new(2.0, 2.0, 0.0), ..Pose::IDENTITY };
        let image = rasterise(&mesh, &CAMERA, &pose);
        assert!(image.depth_m.iter().all(|&d| (d - 2.0).abs() < 1e-6));
        mesh.triangles.reverse();
        let reversed = rasterise(&mesh, &CAMERA, &pose);
        assert_eq!(image.depth_m, reversed.depth_m);
    }

    #[test]
    fn bad_vertices_draw_nothing() {
        let mut mesh = square(1, 4.0, 3.0);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            mesh.positions[0][2] = bad;
            mesh.positions[3][0] = bad;
            let image = rasterise(&mesh, &CAMERA, &Pose::IDENTITY);
            assert!(image.depth_m.iter().all(|d| *d == 0.0));
        }
    }
}
