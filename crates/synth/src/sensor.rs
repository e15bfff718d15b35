//! Depth as a structured-light camera would deliver it.
use super::{
    math::{hash, noise, unit},
    render::Image,
};
use alloc::vec::Vec;
use mte_slam_types::camera::Camera;

/// Metres per unit of the depth images, as in Replica.
pub const DEPTH_UNIT_M: f64 = 1.0 / 6553.5;
/// Kinect's focal length times baseline, in its 640 x 480 pixels times metres.
const FOCAL_BASELINE: f32 = 580.0 * 0.075;
/// Disparities are told apart in eighths of a pixel.
const DISPARITY_STEPS: f32 = 8.0;
const NEAREST_M: f32 = 0.35;
const FARTHEST_M: f32 = 5.5;

/// Depth \[m\] in units of the sequence, 0 (invalid) where it does not fit.
pub fn quantise(depth_m: f32) -> u16 {
    let units = f64::from(depth_m) / DEPTH_UNIT_M + 0.5;
    if (1.0..65536.0).contains(&units) { units as u16 } else { 0 }
}

/// Noise along the ray that grows with depth, disparity steps, jitter along outlines, and holes at
/// depth edges, on surfaces seen at a slant and out of range.
pub fn degrade(image: &Image, camera: &Camera, seed: u64, index: usize) -> Vec<u16> {
    let (w, h) = (camera.width as i32, camera.height as i32);
    let frame = hash(hash(seed as u32 ^ (seed >> 32) as u32) ^ hash(index as u32 ^ 0xD5));
    let at = |u: i32, v: i32| (v.clamp(0, h - 1) * w + u.clamp(0, w - 1)) as usize;
    let mut out = Vec::with_capacity(image.depth_m.len());
    for v in 0..h {
        for u in 0..w {
            let random = |k: u32| unit(hash(frame ^ hash((v * w + u) as u32 ^ (k << 28))));
            // Sum of four uniforms: near enough to normal, and the same on every platform.
            let normal = |k: u32| {
                let sum: f32 = (0..4).map(|i| random(k * 4 + i)).sum();
                (sum - 2.0) * 1.732
            };
            let shift = |n: f32| if n > 1.1 { 1 } else { -i32::from(n < -1.1) };
            let z0 = image.depth_m[at(u, v)];
            let z = image.depth_m[at(u + shift(normal(0)), v + shift(normal(1)))];
            // The projector sits to the right: what is behind an edge to its left is in shadow.
            let right = image.depth_m[at(u + 1, v)].min(image.depth_m[at(u + 2, v)]);
            let shadow = z0 - right > 0.06 + 0.02 * z0;
            let slant = image.facing[at(u, v)];
            let lost = !(NEAREST_M..=FARTHEST_M).contains(&z)
                || (shadow && random(9) < 0.85)
                || slant < 0.10 + 0.12 * random(10)
                || random(11) < 0.002;
            if lost {
                out.push(0);
                continue;
            }
            let sigma = (0.0010 + 0.0016 * (z - 0.4) * (z - 0.4)) / slant.clamp(0.35, 1.0);
            // Part of the error is shared by neighbours, as in a matched window.
            let scale = 48.0 / w as f32;
            let shared = noise(u as f32 * scale * 4.0, v as f32 * scale * 4.0, frame);
            let noisy = z + sigma * (0.75 * normal(3) + 0.9 * shared);
            let disparity = FOCAL_BASELINE / noisy.max(0.1) * DISPARITY_STEPS;
            let step = (disparity + 0.5) as i32 as f32;
            out.push(quantise(FOCAL_BASELINE * DISPARITY_STEPS / step.max(1.0)));
        }
    }
    out
}
