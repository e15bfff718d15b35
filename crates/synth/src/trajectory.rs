//! A hand-held camera's closed path: splines through positions and points looked at, walked at a
//! steady pace, with a little shake.
use super::math::{hash, sin_cos, unit};
use alloc::vec::Vec;
use glam::{DMat3, DVec3};
use mte_slam_types::pose::Pose;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Translation that takes one frame when nothing turns \[m\].
const STEP_M: f64 = 0.028;
/// Rotation that takes one frame when nothing moves \[rad\].
const STEP_RAD: f64 = 0.038;
const SAMPLES: usize = 3000;

/// Where the camera is and what it looks at \[m\].
pub type Waypoint = ([f64; 3], [f64; 3]);

/// The path; frame i is at i steps along it, round and round.
pub struct Path {
    positions: Vec<DVec3>,
    targets: Vec<DVec3>,
    /// Frames taken from the start to each of `SAMPLES` + 1 equal parameter steps.
    pace: Vec<f64>,
    seed: u32,
}

/// Point of the closed uniform Catmull-Rom spline at parameter `u` (one unit per knot).
fn spline(knots: &[DVec3], u: f64) -> DVec3 {
    let n = knots.len();
    let i = u as usize;
    let f = u - i as f64;
    let at = |k: usize| knots[(i + k + n - 1) % n];
    let (a, b, c, d) = (at(0), at(1), at(2), at(3));
    0.5 * (2.0 * b
        + (c - a) * f
        + (2.0 * a - 5.0 * b + 4.0 * c - d) * (f * f)
        + (3.0 * (b - c) + d - a) * (f * f * f))
}

/// Camera at `eye` that looks along `forward`, its x axis horizontal (world z is up).
fn look(eye: DVec3, forward: DVec3) -> Pose {
    let z = forward.normalize();
    let x = z.cross(DVec3::Z).normalize();
    Pose { rotation: DMat3::from_cols(x, z.cross(x), z), translation: eye }
}

impl Path {
    /// Through the way points (at least three), back to the first.
    pub fn new(waypoints: &[Waypoint], seed: u32) -> Path {
        let mut path = Path {
            positions: waypoints.iter().map(|w| DVec3::from(w.0)).collect(),
            targets: waypoints.iter().map(|w| DVec3::from(w.1)).collect(),
            pace: Vec::with_capacity(SAMPLES + 1),
            seed,
        };
        let mut frames = 0.0;
        let mut last = path.smooth(0.0);
        path.pace.push(0.0);
        for i in 1..=SAMPLES {
            let pose = path.smooth(i as f64 / SAMPLES as f64);
            let moved = (pose.translation - last.translation).length() / STEP_M;
            // The chord of the axes: the angle, without an inverse sine.
            let axis =
                |f: fn(&DMat3) -> DVec3| (f(&pose.rotation) - f(&last.rotation)).length_squared();
            let chord = 0.5 * (axis(|r| r.x_axis) + axis(|r| r.y_axis) + axis(|r| r.z_axis));
            let turned2 = chord / (STEP_RAD * STEP_RAD);
            frames += (moved * moved + turned2).sqrt();
            path.pace.push(frames);
            last = pose;
        }
        path
    }

    /// Returns the number of frames in one round.
    pub fn round(&self) -> f64 {
        self.pace[SAMPLES]
    }

    fn smooth(&self, part: f64) -> Pose {
        let u = part * self.positions.len() as f64;
        let eye = spline(&self.positions, u);
        look(eye, spline(&self.targets, u) - eye)
    }

    /// Pose of frame `index`.
    pub fn pose(&self, index: usize) -> Pose {
        let round = self.round();
        let frame = index as f64;
        let along = frame - (frame / round) as u64 as f64 * round;
        let i = self.pace.partition_point(|&p| p <= along).clamp(1, SAMPLES);
        let (p, q) = (self.pace[i - 1], self.pace[i]);
        let part = (i as f64 - 1.0 + (along - p) / (q - p).max(1e-12)) / SAMPLES as f64;
        let pose = self.smooth(part);
        // Shake in time, not along the path: the second round is not the first again.
        let mut shake = [0.0; 6];
        for (axis, s) in shake.iter_mut().enumerate() {
            for k in 0..2u32 {
                let h = hash(self.seed ^ hash(axis as u32 * 2 + k));
                let period = if k == 0 { 28.0 } else { 12.0 } * (0.8 + 0.4 * f64::from(unit(h)));
                let phase = f64::from(unit(hash(h)));
                let amplitude = if k == 0 { 1.0 } else { 0.35 };
                *s += amplitude * sin_cos((frame / period + phase) * core::f64::consts::TAU).0;
            }
        }
        let [a, b, c, x, y, z] = shake;
        let eye = pose.translation + DVec3::new(a, b, c) * 0.006;
        let r = pose.rotation;
        let ahead = r.z_axis + r.x_axis * (0.007 * x) + r.y_axis * (0.007 * y);
        let level = look(eye, ahead);
        let (s, c) = sin_cos(0.009 * z);
        let (rx, ry, rz) = (level.rotation.x_axis, level.rotation.y_axis, level.rotation.z_axis);
        let rotation = DMat3::from_cols(rx * c + ry * s, ry * c - rx * s, rz);
        Pose { rotation, translation: eye }
    }
}
