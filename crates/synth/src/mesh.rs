//! The scene as triangles.
use super::{
    math::sin_cos,
    render::display,
    scene::Scene,
    shape::{Primitive, Shape},
};
use alloc::vec::Vec;
use glam::Vec3;

/// Edge of the squares that flat faces are cut into \[m\].
const CELL_M: f32 = 0.05;
/// Segments around cones and ellipsoids.
const SEGMENTS: usize = 48;

/// Ground-truth surfaces. Triangles wind counter-clockwise as seen from the visible side; what
/// lies inside other solids is left out (cut at whole triangles). Not watertight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SyntheticMesh {
    /// Vertices in the world \[m\].
    pub positions: Vec<[f32; 3]>,
    /// Vertex numbers of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Compact class of each triangle.
    pub face_class: Vec<u8>,
    /// Number of the thing that each triangle is of: one piece of furniture or one other thing as
    /// it was built (a chair, a book, a cushion, a picture with its frame). Walls are one, as are the
    /// floor and the ceiling; boards, beams and columns are things of their own. Numbers have gaps
    /// where nothing of a thing can be seen. A thing has one class.
    pub face_object: Vec<u32>,
    /// sRGB colour of each vertex.
    pub colors: Vec<[u8; 3]>,
}

struct Patch {
    points: Vec<Vec3>,
    /// Points in a row.
    across: usize,
}

/// Points of a face on a grid, chart coordinates increasing.
fn patch(solid: &Primitive, face: u8) -> Patch {
    let half = solid.face_half(face);
    let h = solid.half;
    let mut points = Vec::new();
    let circle = |i: usize| {
        let (s, c) = sin_cos(i as f64 / SEGMENTS as f64 * core::f64::consts::TAU);
        (c as f32, s as f32)
    };
    let place = |q: Vec3| solid.centre + solid.rotation * q;
    let cells = |length: f32| ((length / CELL_M) as usize).max(1);
    match (solid.shape, face) {
        (Shape::Box, _) => {
            let [n, m] = half.map(|x| cells(2.0 * x));
            for j in 0..=m {
                for i in 0..=n {
                    let (a, b) = (i as f32 / n as f32, j as f32 / m as f32);
                    points.push(solid.surface(face, a, b).0);
                }
            }
            Patch { points, across: n + 1 }
        }
        (Shape::Cone { bottom, top }, 0) => {
            let m = cells(2.0 * h.z);
            for j in 0..=m {
                let b = j as f32 / m as f32;
                let r = bottom + (top - bottom) * b;
                for i in 0..=SEGMENTS {
                    let (c, s) = circle(i);
                    points.push(place(Vec3::new(c * r, s * r, (2.0 * b - 1.0) * h.z)));
                }
            }
            Patch { points, across: SEGMENTS + 1 }
        }
        (Shape::Cone { bottom, top }, _) => {
            let r = if face == 4 { bottom } else { top };
            let z = if face == 4 { -h.z } else { h.z };
            let m = cells(r);
            for j in 0..=m {
                // Outside in for the top, so that both caps wind outwards like the side.
                let k = if face == 4 { j } else { m - j } as f32 / m as f32 * r;
                for i in 0..=SEGMENTS {
                    let (c, s) = circle(i);
                    points.push(place(Vec3::new(c * k, s * k, z)));
                }
            }
            Patch { points, across: SEGMENTS + 1 }
        }
        (Shape::Ellipsoid, _) => {
            let m = SEGMENTS / 2;
            for j in 0..=m {
                let (r, z) = sin_cos((1.0 - j as f64 / m as f64) * core::f64::consts::PI);
                for i in 0..=SEGMENTS {
                    let (c, s) = circle(i);
                    points.push(place(Vec3::new(c * r as f32, s * r as f32, z as f32) * h));
                }
            }
            Patch { points, across: SEGMENTS + 1 }
        }
    }
}

/// Tessellates everything that can be seen.
pub fn build(scene: &Scene) -> SyntheticMesh {
    let mut mesh = SyntheticMesh::default();
    for (id, solid) in scene.solids() {
        let is_shell = id as usize == scene.primitives.len();
        for &face in solid.faces() {
            let Patch { points, across } = patch(solid, face);
            let mut number = Vec::new();
            number.resize(points.len(), u32::MAX);
            let mut use_point = |mesh: &mut SyntheticMesh, i: usize| {
                if number[i] == u32::MAX {
                    number[i] = mesh.positions.len() as u32;
                    mesh.positions.push(points[i].to_array());
                    let c = scene.radiance(id, face, points[i], 0.5 * CELL_M);
                    mesh.colors.push(display(c));
                }
                number[i]
            };
            for j in 0..points.len() / across - 1 {
                for i in 0..across - 1 {
                    let at = |di: usize, dj: usize| (j + dj) * across + i + di;
                    for mut t in [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]] {
                        let [p, q, r] = t.map(|k| points[k]);
                        let cross = (q - p).cross(r - p);
                        if cross.length_squared() < 1e-16 {
                            continue;
                        }
                        let middle = (p + q + r) / 3.0;
                        let outward = solid.normal(face, solid.to_local(middle));
                        let visible = if is_shell { -outward } else { outward };
                        if cross.dot(visible) < 0.0 {
                            t.swap(1, 2);
                        }
                        if scene.buried(middle + visible * 1.5e-3) {
                            continue;
                        }
                        let corners = t.map(|k| use_point(&mut mesh, k));
                        mesh.triangles.push(corners);
                        mesh.face_class.push(solid.class[face as usize]);
                        mesh.face_object.push(solid.object[face as usize]);
                    }
                }
            }
        }
    }
    mesh
}
