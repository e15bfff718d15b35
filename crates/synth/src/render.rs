//! From the scene to images: one ray through each pixel's centre for depth and label, four
//! samples for its colour.
use super::{bvh::Hit, scene::Scene};
use alloc::{vec, vec::Vec};
use glam::Vec3;
use mte_slam_types::{camera::Camera, parallel, pose::Pose};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// One rendered view.
pub struct Image {
    /// sRGB.
    pub color: Vec<[u8; 3]>,
    /// Exact depth along z \[m\].
    pub depth_m: Vec<f32>,
    /// Compact classes.
    pub labels: Vec<u8>,
    /// |cosine| between ray and surface normal.
    pub facing: Vec<f32>,
}

/// Rays of a camera: directions have length 1 along the optical axis, so that the ray parameter
/// is the depth.
struct Rays {
    origin: Vec3,
    corner: Vec3,
    du: Vec3,
    dv: Vec3,
}

impl Rays {
    fn new(camera: &Camera, pose: &Pose) -> Rays {
        let r = pose.rotation;
        let du = r.x_axis / camera.fx;
        let dv = r.y_axis / camera.fy;
        Rays {
            origin: pose.translation.as_vec3(),
            corner: (r.z_axis - du * camera.cx - dv * camera.cy).as_vec3(),
            du: du.as_vec3(),
            dv: dv.as_vec3(),
        }
    }

    fn direction(&self, u: f32, v: f32) -> Vec3 {
        self.corner + self.du * u + self.dv * v
    }
}

fn to_srgb(c: Vec3) -> [u8; 3] {
    let f = |x: f32| (x.clamp(0.0, 1.0).sqrt() * 255.0 + 0.5) as u8;
    [f(c.x), f(c.y), f(c.z)]
}

/// Colour as shown of light leaving a surface.
pub fn display(c: Vec3) -> [u8; 3] {
    to_srgb(c)
}

/// Renders the view of `camera` at `pose`.
pub fn render(scene: &Scene, camera: &Camera, pose: &Pose) -> Image {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let rays = Rays::new(camera, pose);
    let mut hits = vec![Hit { t: 0.0, primitive: 0, face: 0 }; w * h];
    parallel::for_chunks(&mut hits, w, |v, row| {
        for (u, hit) in row.iter_mut().enumerate() {
            *hit = scene.trace(rays.origin, rays.direction(u as f32, v as f32));
        }
    });
    let mut color = vec![[0u8; 3]; w * h];
    parallel::for_chunks(&mut color, w, |v, row| {
        for (u, out) in row.iter_mut().enumerate() {
            let hit = hits[v * w + u];
            // The samples see what this pixel and its neighbours see: no search of the scene.
            let mut near = [hit; 9];
            let mut count = 1;
            for y in v.saturating_sub(1)..=(v + 1).min(h - 1) {
                for x in u.saturating_sub(1)..=(u + 1).min(w - 1) {
                    let other = hits[y * w + x];
                    if near[..count].iter().all(|n| n.primitive != other.primitive) {
                        near[count] = other;
                        count += 1;
                    }
                }
            }
            let mut sum = Vec3::ZERO;
            for (du, dv) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                let d = rays.direction(u as f32 + du, v as f32 + dv);
                let s = near[..count]
                    .iter()
                    .filter_map(|n| scene.retrace(n.primitive, rays.origin, d))
                    .min_by(|a, b| a.t.total_cmp(&b.t))
                    .unwrap_or_else(|| scene.trace(rays.origin, d));
                let p = rays.origin + d * s.t;
                let cos = scene.normal(&s, p).dot(d).abs() / d.length();
                // Half a pixel, stretched where the surface is seen at a slant.
                let footprint = 0.5 * s.t * rays.du.length() / (0.35 + 0.65 * cos).max(0.1);
                sum += scene.radiance(s.primitive, s.face, p, footprint).min(Vec3::ONE);
            }
            *out = to_srgb(0.25 * sum);
        }
    });
    let facing = hits
        .iter()
        .enumerate()
        .map(|(i, hit)| {
            let d = rays.direction((i % w) as f32, (i / w) as f32);
            scene.normal(hit, rays.origin + d * hit.t).dot(d).abs() / d.length()
        })
        .collect();
    Image {
        color,
        depth_m: hits.iter().map(|hit| hit.t).collect(),
        labels: hits.iter().map(|hit| scene.class(hit)).collect(),
        facing,
    }
}
