//! A frame as the alignment wants it: intensity with gradients, depth, local planes, at several
//! sizes.
use super::{OdometryError, config::PyramidConfig, registration::ColorRegistration};
use alloc::{vec, vec::Vec};
use glam::DVec3;
use mte_slam_types::{camera::Camera, frame::Frame, pose::Pose};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;
#[cfg(feature = "threads")]
use rayon::prelude::*;

/// A point of the frame that is being located.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Camera coordinates \[m\].
    pub p: [f32; 3],
    /// Intensity, 0..1.
    pub intensity: f32,
    /// Unit normal away from the camera, or zero where there is none.
    pub n: [f32; 3],
}

/// One size of a [`RgbdPyramid`].
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub width: usize,
    pub height: usize,
    pub fx: f32,
    pub fy: f32,
    pub cx: f32,
    pub cy: f32,
    /// Intensity, its gradient along x and y \[1/pixel\], depth \[m\] (0: none).
    pub texels: Vec<[f32; 4]>,
    /// Unit normal n away from the camera and offset d of the local plane n . p = d; n = 0: none.
    pub planes: Vec<[f32; 4]>,
    /// The pixels with depth, row by row.
    pub points: Vec<Point>,
}

/// A frame prepared for alignment; build once, use as the current frame and as a reference.
#[derive(Clone, Debug)]
pub struct RgbdPyramid {
    /// `Frame::index` of the frame it was made from.
    pub frame: usize,
    pub(super) levels: Vec<Level>,
    /// Median depth \[m\], 0 without depth.
    pub(super) median_depth_m: f64,
    /// Shape of depth noise, see [`PyramidConfig`].
    pub(super) noise: [f32; 2],
    /// Intensity as recorded, full size.
    pub(super) intensity: Vec<f32>,
    /// What `intensity` has been resampled with for the levels.
    pub(super) registration: ColorRegistration,
}

impl RgbdPyramid {
    /// Fewest usable depth pixels that an alignment accepts.
    pub const MIN_POINTS: usize = 300;

    /// Prepares a frame. `depth_unit_m`: metres per unit of `Frame::depth`.
    ///
    /// # Errors
    /// [`OdometryError::ImageSize`]. A frame without depth is accepted here and refused by
    /// [`super::align`].
    pub fn new(
        frame: &Frame,
        camera: &Camera,
        depth_unit_m: f64,
        config: &PyramidConfig,
    ) -> Result<RgbdPyramid, OdometryError> {
        let expected = camera.pixels();
        for (image, found) in [("colour", frame.color.len()), ("depth", frame.depth.len())] {
            if found != expected {
                return Err(OdometryError::ImageSize {
                    frame: frame.index,
                    image,
                    found,
                    expected,
                });
            }
        }
        // Rec. 601 luma of the gamma-coded values: close to uniform noise over the range.
        let intensity = frame
            .color
            .iter()
            .map(|c| {
                (0.299 * f32::from(c[0]) + 0.587 * f32::from(c[1]) + 0.114 * f32::from(c[2]))
                    / 255.0
            })
            .collect::<Vec<f32>>();
        let limit = config.max_depth_m as f32;
        let depth = frame
            .depth
            .iter()
            .map(|&d| {
                let z = f32::from(d) * depth_unit_m as f32;
                if z > 0.05 && z < limit { z } else { 0.0 }
            })
            .collect::<Vec<f32>>();
        Ok(Self::from_images(frame.index, intensity, depth, camera, config))
    }

    /// Prepares one from intensity (0..1) and depth (m, 0: none), both row-major of the camera's size.
    pub(super) fn from_images(
        frame: usize,
        mut intensity: Vec<f32>,
        mut depth: Vec<f32>,
        camera: &Camera,
        config: &PyramidConfig,
    ) -> RgbdPyramid {
        let noise = [config.depth_noise_m as f32, config.depth_noise_per_m2 as f32];
        let mut camera = *camera;
        let recorded = intensity.clone();
        let mut levels = Vec::new();
        loop {
            let (w, h) = (camera.width as usize, camera.height as usize);
            levels.push(Level::new(&camera, &intensity, &depth, config, noise));
            if levels.len() >= config.levels.max(1) as usize
                || camera.width.min(camera.height) / 2 < config.smallest_side.max(8)
            {
                break;
            }
            intensity = halve_intensity(&intensity, w, h);
            depth = halve_depth(&depth, w, h, noise);
            camera = camera.downscaled(2);
        }
        let mut z = levels[0].points.iter().map(|p| p.p[2]).collect::<Vec<f32>>();
        let median_depth_m = if z.is_empty() {
            0.0
        } else {
            let k = z.len() / 2;
            f64::from(*z.select_nth_unstable_by(k, f32::total_cmp).1)
        };
        RgbdPyramid {
            frame,
            levels,
            median_depth_m,
            noise,
            intensity: recorded,
            registration: ColorRegistration::default(),
        }
    }

    /// Resamples the colour so that it lies on the depth; nothing to do when it already is so.
    pub(super) fn register(&mut self, registration: &ColorRegistration) {
        if self.registration == *registration {
            return;
        }
        self.registration = *registration;
        let (w, h) = (self.levels[0].width, self.levels[0].height);
        let scale = registration.scale as f32;
        let (cx, cy) = (self.levels[0].cx, self.levels[0].cy);
        let mut image = vec![0.0f32; w * h];
        for v in 0..h {
            let y = (cy + scale * (v as f32 - cy)).clamp(0.0, (h - 1) as f32);
            let iy = (y as usize).min(h - 2);
            let fy = y - iy as f32;
            for u in 0..w {
                let x = (cx + scale * (u as f32 - cx)).clamp(0.0, (w - 1) as f32);
                let ix = (x as usize).min(w - 2);
                let fx = x - ix as f32;
                let i = iy * w + ix;
                let top = self.intensity[i] + fx * (self.intensity[i + 1] - self.intensity[i]);
                let i = i + w;
                let bottom = self.intensity[i] + fx * (self.intensity[i + 1] - self.intensity[i]);
                image[v * w + u] = top + fy * (bottom - top);
            }
        }
        let mut size = (w, h);
        for (k, level) in self.levels.iter_mut().enumerate() {
            if k > 0 {
                image = halve_intensity(&image, size.0, size.1);
                size = (level.width, level.height);
            }
            level.set_intensity(&image);
        }
    }

    /// Returns the number of pixels with usable depth at full size.
    pub fn usable_points(&self) -> usize {
        self.levels[0].points.len()
    }

    /// Returns the median of the usable depths \[m\]; 0 when there are none.
    pub fn median_depth_m(&self) -> f64 {
        self.median_depth_m
    }

    /// Returns the share of the current frame's points (at a small size) that this image sees at about their
    /// depth, given both poses (`world_from_camera`).
    pub(super) fn visible_share(
        &self,
        pose: &Pose,
        current: &RgbdPyramid,
        current_pose: &Pose,
    ) -> f64 {
        let k = self.levels.len().min(current.levels.len()).min(4) - 1;
        let (level, points) = (&self.levels[k], &current.levels[k].points);
        let relative = pose.inverse().compose(current_pose);
        let mut seen = 0usize;
        for point in points {
            let [x, y, z] = point.p.map(f64::from);
            let q = relative.transform_point(DVec3::new(x, y, z));
            if q.z < 0.05 {
                continue;
            }
            let u = f64::from(level.fx) * q.x / q.z + f64::from(level.cx) + 0.5;
            let v = f64::from(level.fy) * q.y / q.z + f64::from(level.cy) + 0.5;
            if u >= 0.0 && v >= 0.0 && u < level.width as f64 && v < level.height as f64 {
                let z = f64::from(level.texels[v as usize * level.width + u as usize][3]);
                if z > 0.0 && (z - q.z).abs() < 0.1 * z {
                    seen += 1;
                }
            }
        }
        seen as f64 / points.len().max(1) as f64
    }

    pub(super) fn check(&self) -> Result<(), OdometryError> {
        let found = self.usable_points();
        if found < Self::MIN_POINTS {
            return Err(OdometryError::NoDepth {
                frame: self.frame,
                found,
                expected: Self::MIN_POINTS,
            });
        }
        Ok(())
    }
}

/// 2x2 box: what [`Camera::downscaled`] assumes.
pub(super) fn halve_intensity(image: &[f32], w: usize, h: usize) -> Vec<f32> {
    let (hw, hh) = (w / 2, h / 2);
    let mut out = Vec::with_capacity(hw * hh);
    for v in 0..hh {
        for u in 0..hw {
            let i = 2 * v * w + 2 * u;
            out.push(0.25 * (image[i] + image[i + 1] + image[i + w] + image[i + w + 1]));
        }
    }
    out
}

/// Returns the mean of those of the four depths that lie on one surface: a mean over a step would invent
/// points in the air.
fn halve_depth(depth: &[f32], w: usize, h: usize, noise: [f32; 2]) -> Vec<f32> {
    let (hw, hh) = (w / 2, h / 2);
    let mut out = Vec::with_capacity(hw * hh);
    for v in 0..hh {
        for u in 0..hw {
            let i = 2 * v * w + 2 * u;
            let block = [depth[i], depth[i + 1], depth[i + w], depth[i + w + 1]];
            let mut best = 0.0;
            let mut most = 0;
            for &z in &block {
                if z <= 0.0 {
                    continue;
                }
                let near = 0.02 * z + 3.0 * (noise[0] + noise[1] * z * z);
                let mut sum = 0.0;
                let mut n = 0;
                for &other in &block {
                    if other > 0.0 && (other - z).abs() < near {
                        sum += 1.0 / other;
                        n += 1;
                    }
                }
                if n > most {
                    most = n;
                    best = n as f32 / sum;
                }
            }
            out.push(if most >= 2 { best } else { 0.0 });
        }
    }
    out
}

impl Level {
    /// Replaces the intensity and its gradients.
    fn set_intensity(&mut self, intensity: &[f32]) {
        let (w, h) = (self.width, self.height);
        let mut points = self.points.iter_mut();
        for v in 0..h {
            for u in 0..w {
                let i = v * w + u;
                let (l, r) = (i - usize::from(u > 0), i + usize::from(u + 1 < w));
                let (t, b) = (i - if v > 0 { w } else { 0 }, i + if v + 1 < h { w } else { 0 });
                self.texels[i][0] = intensity[i];
                self.texels[i][1] = 0.5 * (intensity[r] - intensity[l]);
                self.texels[i][2] = 0.5 * (intensity[b] - intensity[t]);
                if self.texels[i][3] > 0.0
                    && let Some(point) = points.next()
                {
                    point.intensity = intensity[i];
                }
            }
        }
    }

    fn new(
        camera: &Camera,
        intensity: &[f32],
        depth: &[f32],
        config: &PyramidConfig,
        noise: [f32; 2],
    ) -> Level {
        let (w, h) = (camera.width as usize, camera.height as usize);
        let mut level = Level {
            width: w,
            height: h,
            fx: camera.fx as f32,
            fy: camera.fy as f32,
            cx: camera.cx as f32,
            cy: camera.cy as f32,
            texels: vec![[0.0; 4]; w * h],
            planes: vec![[0.0; 4]; w * h],
            points: Vec::new(),
        };
        let inverse =
            depth.iter().map(|&z| if z > 0.0 { 1.0 / z } else { 0.0 }).collect::<Vec<f32>>();
        let mut planes = core::mem::take(&mut level.planes);
        let row = |v: usize, out: &mut [[f32; 4]]| {
            if v >= 1 && v + 1 < h {
                for u in 1..w - 1 {
                    out[u] = level.fit_plane(&inverse, u, v, noise);
                }
            }
        };
        #[cfg(feature = "threads")]
        planes.par_chunks_mut(w).enumerate().for_each(|(v, out)| row(v, out));
        #[cfg(not(feature = "threads"))]
        planes.chunks_mut(w).enumerate().for_each(|(v, out)| row(v, out));
        level.planes = planes;
        for v in 0..h {
            for u in 0..w {
                let i = v * w + u;
                let (l, r) = (i - usize::from(u > 0), i + usize::from(u + 1 < w));
                let (t, b) = (i - if v > 0 { w } else { 0 }, i + if v + 1 < h { w } else { 0 });
                level.texels[i] = [
                    intensity[i],
                    0.5 * (intensity[r] - intensity[l]),
                    0.5 * (intensity[b] - intensity[t]),
                    depth[i],
                ];
                if depth[i] <= 0.0 {
                    continue;
                }
                let ray = [(u as f32 - level.cx) / level.fx, (v as f32 - level.cy) / level.fy, 1.0];
                let [nx, ny, nz, d] = level.planes[i];
                let mut z = depth[i];
                if config.smooth_depth && d > 0.0 {
                    z = d / (nx * ray[0] + ny * ray[1] + nz);
                }
                level.points.push(Point {
                    p: [ray[0] * z, ray[1] * z, z],
                    intensity: intensity[i],
                    n: [nx, ny, nz],
                });
            }
        }
        level
    }

    /// Least-squares plane around a pixel. In inverse depth a plane is linear in the pixel, so the
    /// fit is exact for planes at any slope and disparity noise is uniform.
    fn fit_plane(&self, inverse: &[f32], u: usize, v: usize, noise: [f32; 2]) -> [f32; 4] {
        let w0 = inverse[v * self.width + u];
        if w0 <= 0.0 {
            return [0.0; 4];
        }
        let z = 1.0 / w0;
        let radius = if self.width >= 120 && u >= 2 && v >= 2 {
            if u + 2 < self.width && v + 2 < self.height { 2 } else { 1 }
        } else {
            1
        };
        // Neighbours on one surface: slope up to 4 (76 degrees) plus noise.
        let per_pixel = 4.0 / self.fx * w0;
        let base = 3.0 * (noise[0] + noise[1] * z * z) * w0 * w0;
        let (mut n, mut si, mut sj, mut sii, mut sij, mut sjj) = (0.0f32, 0.0, 0.0, 0.0, 0.0, 0.0);
        let (mut sd, mut sid, mut sjd, mut sdd) = (0.0f32, 0.0, 0.0, 0.0);
        let r = radius as i32;
        for dv in -r..=r {
            let start = (v as i32 + dv) as usize * self.width + u - radius;
            for (k, &value) in inverse[start..start + 2 * radius + 1].iter().enumerate() {
                let du = k as i32 - r;
                let d = value - w0;
                let limit = base + per_pixel * du.abs().max(dv.abs()) as f32;
                if value > 0.0 && d.abs() < limit {
                    let (x, y) = (du as f32, dv as f32);
                    n += 1.0;
                    si += x;
                    sj += y;
                    sii += x * x;
                    sij += x * y;
                    sjj += y * y;
                    sd += d;
                    sid += x * d;
                    sjd += y * d;
                    sdd += d * d;
                }
            }
        }
        let side = (2 * radius + 1) as f32;
        if n < 0.6 * side * side {
            return [0.0; 4];
        }
        // Centre the sums, then a 2x2 system.
        let inv = 1.0 / n;
        let (mi, mj, md) = (si * inv, sj * inv, sd * inv);
        let (cii, cij, cjj) = (sii - si * mi, sij - si * mj, sjj - sj * mj);
        let (cid, cjd) = (sid - si * md, sjd - sj * md);
        let det = cii * cjj - cij * cij;
        if det < 1e-3 * n {
            return [0.0; 4];
        }
        let a = (cid * cjj - cjd * cij) / det;
        let b = (cjd * cii - cid * cij) / det;
        let fitted = w0 + md - a * mi - b * mj;
        let rest = ((sdd - sd * md - a * cid - b * cjd).max(0.0) * inv).sqrt();
        if fitted <= 0.0 || rest * z > 0.02 {
            return [0.0; 4];
        }
        let normal = [
            a * self.fx,
            b * self.fy,
            a * (self.cx - u as f32) + b * (self.cy - v as f32) + fitted,
        ];
        let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
        // Surfaces seen at more than about 80 degrees carry more edge than plane.
        let ray = [(u as f32 - self.cx) / self.fx, (v as f32 - self.cy) / self.fy];
        let slant = fitted / (length * (1.0 + ray[0] * ray[0] + ray[1] * ray[1]).sqrt());
        if slant < 0.17 {
            return [0.0; 4];
        }
        let s = 1.0 / length;
        [normal[0] * s, normal[1] * s, normal[2] * s, s]
    }
}
