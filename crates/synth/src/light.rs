//! Diffuse light, computed once into small maps on every face: soft shadows of two area lights and
//! ambient occlusion. The result does not depend on the view.
use super::{
    bvh::PrimitiveBvh,
    math::{floor, fract, hash, sin_cos, unit},
    shape::{Chart, Primitive, Shape},
};
use alloc::{vec, vec::Vec};
use glam::Vec3;
use mte_slam_types::parallel;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Distance between map texels \[m\], where a face is not tiny.
const TEXEL_M: f32 = 0.06;
/// Occluders farther than this leave the ambient light alone \[m\].
const AMBIENT_REACH_M: f32 = 0.7;
const AMBIENT_RAYS: u32 = 16;

/// A light: points it shines from, and its colour.
#[derive(Clone, Debug)]
pub struct Light {
    /// Sample points.
    pub points: Vec<Vec3>,
    /// Direction it faces, or zero when it shines all around.
    pub facing: Vec3,
    /// Irradiance at 1 m \[linear RGB\].
    pub power: Vec3,
}

#[derive(Clone, Copy, Default)]
struct Map {
    offset: u32,
    size: [u16; 2],
}

/// The light maps of all faces; the room's shell comes after the last primitive.
pub struct LightMaps {
    maps: Vec<[Map; 6]>,
    texels: Vec<Vec3>,
}

fn hemisphere() -> Vec<Vec3> {
    (0..AMBIENT_RAYS)
        .map(|i| {
            // Cosine-weighted spiral.
            let r2 = (i as f32 + 0.5) / AMBIENT_RAYS as f32;
            let (s, c) = sin_cos(f64::from(i) * 2.399_963_229_728_653);
            let r = r2.sqrt();
            Vec3::new(r * c as f32, r * s as f32, (1.0 - r2).sqrt())
        })
        .collect()
}

/// Two directions across a normal.
fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let other = if n.z.abs() < 0.9 { Vec3::Z } else { Vec3::X };
    let x = n.cross(other).normalize();
    (x, n.cross(x))
}

impl LightMaps {
    /// Bakes the light of `lights` and a sky of `ambient` in the scene.
    pub fn bake(
        shell: &Primitive,
        primitives: &[Primitive],
        bvh: &PrimitiveBvh,
        lights: &[Light],
        ambient: Vec3,
    ) -> LightMaps {
        let mut maps = vec![[Map::default(); 6]; primitives.len() + 1];
        let mut texels_of = Vec::new();
        for (id, faces) in maps.iter_mut().enumerate() {
            let solid = primitives.get(id).unwrap_or(shell);
            for &face in solid.faces() {
                let half = solid.face_half(face);
                let size = half.map(|h| ((2.0 * h / TEXEL_M) as i32 + 1).clamp(2, 160) as u16);
                faces[face as usize] = Map { offset: texels_of.len() as u32, size };
                for j in 0..size[1] {
                    for i in 0..size[0] {
                        texels_of.push((id as u32, face, i, j, size));
                    }
                }
            }
        }
        let rays = hemisphere();
        let mut texels = vec![Vec3::ZERO; texels_of.len()];
        parallel::for_chunks(&mut texels, 256, |chunk, out| {
            for (k, e) in out.iter_mut().enumerate() {
                let index = chunk * 256 + k;
                let (id, face, i, j, size) = texels_of[index];
                let a = (f32::from(i) + 0.5) / f32::from(size[0]);
                let b = (f32::from(j) + 0.5) / f32::from(size[1]);
                let (p, n) = match primitives.get(id as usize) {
                    Some(solid) => solid.surface(face, a, b),
                    None => {
                        let (p, n) = shell.surface(face, a, b);
                        (p, -n)
                    }
                };
                let o = p + n * 2e-3;
                *e = irradiance(primitives, bvh, lights, ambient, &rays, o, n, index as u32);
            }
        });
        LightMaps { maps, texels }
    }

    /// Light on a face (`primitive` = number of primitives for the shell) at a chart position.
    pub fn sample(&self, primitive: u32, face: u8, chart: &Chart, shape: Shape) -> Vec3 {
        let map = self.maps[primitive as usize][face as usize];
        let [w, h] = map.size.map(i32::from);
        let (x, y) = (chart.a * w as f32 - 0.5, chart.b * h as f32 - 0.5);
        let (i, j) = (floor(x), floor(y));
        let (u, v) = (fract(x), fract(y));
        let round = shape != Shape::Box && face == 0;
        let at = |i: i32, j: i32| {
            let i = if round { i.rem_euclid(w) } else { i.clamp(0, w - 1) };
            self.texels[(map.offset as i32 + j.clamp(0, h - 1) * w + i) as usize]
        };
        let top = at(i, j) * (1.0 - u) + at(i + 1, j) * u;
        let bottom = at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u;
        top * (1.0 - v) + bottom * v
    }
}

fn irradiance(
    primitives: &[Primitive],
    bvh: &PrimitiveBvh,
    lights: &[Light],
    ambient: Vec3,
    rays: &[Vec3],
    o: Vec3,
    n: Vec3,
    index: u32,
) -> Vec3 {
    let (x, y) = tangents(n);
    // A few turns of the ray set, so that neighbours do not share their mistakes.
    let (s, c) = sin_cos(f64::from(unit(hash(index))) * core::f64::consts::TAU);
    let (s, c) = (s as f32, c as f32);
    let open = rays
        .iter()
        .filter(|r| {
            let d = x * (c * r.x - s * r.y) + y * (s * r.x + c * r.y) + n * r.z;
            !bvh.blocked(primitives, o, d, AMBIENT_REACH_M)
        })
        .count() as f32
        / rays.len() as f32;
    // Light bounced off the floor is warmer and weaker than what comes from above.
    let up = 0.5 + 0.5 * n.z;
    let sky = ambient * (Vec3::new(0.92, 0.84, 0.76) * (1.0 - up) + Vec3::splat(1.08) * up);
    let mut e = sky * (0.12 + 0.88 * open);
    for light in lights {
        let mut sum = 0.0;
        for &q in &light.points {
            let to = q - o;
            let d2 = to.length_squared().max(0.04);
            let cos = to.dot(n);
            let out =
                if light.facing == Vec3::ZERO { 1.0 } else { -to.dot(light.facing) / d2.sqrt() };
            if cos > 0.0 && out > 0.0 && !bvh.blocked(primitives, o, to, 0.98) {
                sum += cos / d2.sqrt() * out / d2;
            }
        }
        e += light.power * (sum / light.points.len() as f32);
    }
    e
}
