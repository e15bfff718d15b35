//! Surface points that a frame sees.
use crate::{camera::Camera, frame::Frame, kernels::shared::random_u32, pose::Pose};
use alloc::vec::Vec;
use glam::DVec3;
use mte_slam_shaders::random::salt;

/// Camera-frame points of about `count` pixels with depth, on a jittered grid: x, y, z \[m\] and
/// intensity in 0..1.
pub(super) fn sample_points(
    frame: &Frame,
    camera: &Camera,
    depth_unit_m: f64,
    count: usize,
    seed: u32,
) -> Vec<[f32; 4]> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let step = num_traits::Float::sqrt((w * h) as f64 / count.max(1) as f64).max(1.0);
    let (nx, ny) = ((w as f64 / step) as usize, (h as f64 / step) as usize);
    let mut out = Vec::with_capacity(nx * ny);
    for j in 0..ny {
        for i in 0..nx {
            let r = random_u32(seed, frame.index as u32, (j * nx + i) as u32, salt::KEYFRAME_POINT);
            let jitter = |bits: u32| f64::from(bits & 0xffff) / 65536.0;
            let u = (((i as f64 + jitter(r)) * step) as usize).min(w - 1);
            let v = (((j as f64 + jitter(r >> 16)) * step) as usize).min(h - 1);
            let at = v * w + u;
            let d = f64::from(frame.depth[at]) * depth_unit_m;
            if d <= 0.0 {
                continue;
            }
            let p = camera.back_project(u as f64, v as f64, d);
            let [r, g, b] = frame.color[at].map(f32::from);
            let intensity = (0.299 * r + 0.587 * g + 0.114 * b) / 255.0;
            out.push([p.x as f32, p.y as f32, p.z as f32, intensity]);
        }
    }
    out
}

/// Share of world points that a camera sees (frustum only), 0 without points.
pub(super) fn overlap(points_world: &[DVec3], camera: &Camera, world_from_camera: &Pose) -> f64 {
    if points_world.is_empty() {
        return 0.0;
    }
    let camera_from_world = world_from_camera.inverse();
    let seen = points_world.iter().filter(|p| {
        camera.project(camera_from_world.transform_point(**p)).is_some_and(|uv| {
            uv.x >= 0.0
                && uv.y >= 0.0
                && uv.x < f64::from(camera.width)
                && uv.y < f64::from(camera.height)
        })
    });
    seen.count() as f64 / points_world.len() as f64
}
