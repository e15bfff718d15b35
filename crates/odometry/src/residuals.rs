//! Residuals of one reference image at one level, summed into normal equations.
//!
//! The order of every sum is fixed (chunks of a fixed number of points, added in order), so the
//! result has the same bits for any number of threads.
use super::pyramid::{Level, Point};
use alloc::{vec, vec::Vec};
#[cfg(feature = "threads")]
use rayon::prelude::*;

/// Points a task takes; short enough that f32 sums stay exact to 1e-5.
const CHUNK: usize = 2048;
/// Bins of the residual histograms: 8 an octave over 32 octaves.
const BINS: usize = 256;

/// What the residuals depend on besides the images.
#[derive(Clone, Debug)]
pub(super) struct Model {
    /// Rotation of `reference_from_current`, rows.
    pub r: [[f32; 3]; 3],
    /// Its translation \[m\].
    pub t: [f32; 3],
    /// Reference intensity = gain * current + bias.
    pub gain: f32,
    /// See `gain`.
    pub bias: f32,
    /// Robust standard deviation of the geometric residual in units of the noise model.
    pub geometric_scale: f32,
    /// Robust standard deviation of the photometric residual.
    pub photometric_sigma: f32,
    pub photometric_weight: f32,
    pub geometric_weight: f32,
    pub kernel_width: f32,
    pub gate: f32,
    pub normal_cos: f32,
    pub pixel_noise: f32,
    pub noise: [f32; 2],
    /// One point in this many is used.
    pub stride: usize,
}

/// Sums over points. The parameters are the twist (v, w) in the reference frame (point moves by
/// v + w x (R p)), then gain and bias.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    /// Normal matrix.
    pub h: [[f64; 8]; 8],
    /// Gradient (J^T W r).
    pub b: [f64; 8],
    /// Robust cost.
    pub cost: f64,
    /// Robust cost with scales that do not depend on the data: compares poses.
    pub fixed_cost: f64,
    /// Points tried.
    pub tried: u32,
    /// Points that fall into the reference image.
    pub in_view: u32,
    /// Points with a geometric residual.
    pub geometric: u32,
    /// Points whose geometric residual is within three robust standard deviations.
    pub inliers: u32,
    /// Points with a photometric residual.
    pub photometric: u32,
    /// Weighted sum of squared point-to-plane distances \[m^2\], and of its weights.
    pub geometric_square: [f64; 2],
    /// Weighted sum of squared intensity differences, and of its weights.
    pub photometric_square: [f64; 2],
    /// Histogram of log |residual|, geometric.
    pub geometric_bins: Vec<u32>,
    /// Histogram of log |residual|, photometric.
    pub photometric_bins: Vec<u32>,
}

impl Sums {
    fn zero() -> Sums {
        Sums {
            h: [[0.0; 8]; 8],
            b: [0.0; 8],
            cost: 0.0,
            fixed_cost: 0.0,
            tried: 0,
            in_view: 0,
            geometric: 0,
            inliers: 0,
            photometric: 0,
            geometric_square: [0.0; 2],
            photometric_square: [0.0; 2],
            geometric_bins: vec![0; BINS],
            photometric_bins: vec![0; BINS],
        }
    }

    fn add(&mut self, o: &Sums) {
        for i in 0..8 {
            for j in 0..8 {
                self.h[i][j] += o.h[i][j];
            }
            self.b[i] += o.b[i];
        }
        self.cost += o.cost;
        self.fixed_cost += o.fixed_cost;
        self.tried += o.tried;
        self.in_view += o.in_view;
        self.geometric += o.geometric;
        self.inliers += o.inliers;
        self.photometric += o.photometric;
        for i in 0..2 {
            self.geometric_square[i] += o.geometric_square[i];
            self.photometric_square[i] += o.photometric_square[i];
        }
        for i in 0..BINS {
            self.geometric_bins[i] += o.geometric_bins[i];
            self.photometric_bins[i] += o.photometric_bins[i];
        }
    }

    /// 1.4826 median |geometric residual| in units of the noise model.
    pub fn geometric_mad(&self) -> Option<f32> {
        median(&self.geometric_bins).map(|m| 1.4826 * m)
    }

    /// 1.4826 median |photometric residual|.
    pub fn photometric_mad(&self) -> Option<f32> {
        median(&self.photometric_bins).map(|m| 1.4826 * m)
    }
}

/// Exponent and top three mantissa bits of |x|, from 2^-24 up.
fn bin(x: f32) -> usize {
    let bits = (x.abs().to_bits() >> 20) as usize;
    bits.saturating_sub((127 - 24) * 8).min(BINS - 1)
}

fn bin_start(i: usize) -> f32 {
    f32::from_bits(((i + (127 - 24) * 8) as u32) << 20)
}

/// Returns the median of what a histogram holds, linear within the bin.
fn median(bins: &[u32]) -> Option<f32> {
    let total: u32 = bins.iter().sum();
    if total < 16 {
        return None;
    }
    let half = total / 2;
    let mut below = 0;
    for (i, &n) in bins.iter().enumerate() {
        if below + n > half {
            let f = (half - below) as f32 / n as f32;
            return Some(bin_start(i) + f * (bin_start(i + 1) - bin_start(i)));
        }
        below += n;
    }
    None
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn rotate(r: &[[f32; 3]; 3], p: [f32; 3]) -> [f32; 3] {
    [dot(r[0], p), dot(r[1], p), dot(r[2], p)]
}

/// Residuals of `points` (of the current frame) against `reference`.
pub(super) fn evaluate(reference: &Level, points: &[Point], model: &Model) -> Sums {
    let size = CHUNK * model.stride;
    let mut total = Sums::zero();
    #[cfg(feature = "threads")]
    let parts =
        points.par_chunks(size).map(|c| evaluate_chunk(reference, c, model)).collect::<Vec<_>>();
    #[cfg(not(feature = "threads"))]
    let parts = points.chunks(size).map(|c| evaluate_chunk(reference, c, model));
    for part in parts {
        total.add(&part);
    }
    total
}

fn evaluate_chunk(level: &Level, points: &[Point], m: &Model) -> Sums {
    let mut out = Sums::zero();
    let mut h = [[0.0f32; 8]; 8];
    let mut b = [0.0f32; 8];
    let mut cost = 0.0f32;
    let mut fixed = 0.0f32;
    let mut geometric_square = [0.0f32; 2];
    let mut photometric_square = [0.0f32; 2];
    let (wi, he) = (level.width, level.height);
    let (u_end, v_end) = (wi as f32 - 2.0, he as f32 - 2.0);
    let width2 = m.kernel_width * m.kernel_width;
    let outlier = 0.5 * width2;
    let pixel2 = m.pixel_noise * m.pixel_noise / (level.fx * level.fx);
    let edge2 = m.pixel_noise * m.pixel_noise;
    let photo_floor2 = m.photometric_sigma * m.photometric_sigma;
    for point in points.iter().step_by(m.stride) {
        out.tried += 1;
        let rp = rotate(&m.r, point.p);
        let q = [rp[0] + m.t[0], rp[1] + m.t[1], rp[2] + m.t[2]];
        if q[2] < 0.05 {
            continue;
        }
        let iz = 1.0 / q[2];
        let (x, y) = (q[0] * iz, q[1] * iz);
        let (u, v) = (level.fx * x + level.cx, level.fy * y + level.cy);
        // Comparisons are false for NaN, so nothing below sees one.
        if !(u >= 1.0 && v >= 1.0 && u < u_end && v < v_end) {
            continue;
        }
        out.in_view += 1;
        let near = (v + 0.5) as usize * wi + (u + 0.5) as usize;
        let z = level.texels[near][3];
        let dz = q[2] - z;
        if z <= 0.0 {
            continue;
        }
        if dz.abs() > m.gate * z {
            cost += 2.0 * outlier;
            fixed += 1.5;
            continue;
        }
        let plane = level.planes[near];
        let n = [plane[0], plane[1], plane[2]];
        if plane[3] > 0.0 {
            let rn = rotate(&m.r, point.n);
            if dot(rn, n) >= m.normal_cos {
                let r = dot(n, q) - plane[3];
                // Depth noise acts along the ray, misregistration across it.
                let along = n[0] * x + n[1] * y + n[2];
                let sz = m.noise[0] + m.noise[1] * z * z;
                let sigma2 = along * along * sz * sz + pixel2 * z * z;
                let unit = 1.0 / sqrt(sigma2);
                let raw = r * unit;
                out.geometric_bins[bin(raw)] += 1;
                out.geometric += 1;
                fixed += (raw * raw * (1.0 / 16.0)).min(1.0);
                let inv = 1.0 / m.geometric_scale;
                let e = raw * inv;
                let e2 = e * e;
                let k = width2 / (width2 + e2);
                let w = m.geometric_weight * k * k;
                cost += m.geometric_weight * 0.5 * e2 * k;
                if e2 < 9.0 {
                    out.inliers += 1;
                    geometric_square[0] += r * r;
                    geometric_square[1] += 1.0;
                }
                let s = unit * inv;
                let c = cross(rp, n);
                let j = [n[0] * s, n[1] * s, n[2] * s, c[0] * s, c[1] * s, c[2] * s, 0.0, 0.0];
                accumulate(&mut h, &mut b, &j, w, e);
            } else {
                cost += outlier;
                fixed += 1.0;
            }
        }
        if m.photometric_weight > 0.0 {
            let (iu, iv) = (u as usize, v as usize);
            let (fu, fv) = (u - iu as f32, v - iv as f32);
            let i = iv * wi + iu;
            let (t00, t01) = (level.texels[i], level.texels[i + 1]);
            let (t10, t11) = (level.texels[i + wi], level.texels[i + wi + 1]);
            let mut s = [0.0f32; 4];
            for k in 0..4 {
                let top = t00[k] + fu * (t01[k] - t00[k]);
                let bottom = t10[k] + fu * (t11[k] - t10[k]);
                s[k] = top + fv * (bottom - top);
            }
            let r = s[0] - m.gain * point.intensity - m.bias;
            let g2 = s[1] * s[1] + s[2] * s[2];
            // Edges: interpolation and misregistration grow with the gradient.
            let spread = 1.0 + g2 * edge2 / (photo_floor2 + 1e-6);
            let unit = 1.0 / sqrt(spread);
            out.photometric_bins[bin(r * unit)] += 1;
            out.photometric += 1;
            fixed += 0.5 * (r * r * 100.0).min(1.0);
            let inv = unit / m.photometric_sigma;
            let e = r * inv;
            let e2 = e * e;
            let k = width2 / (width2 + e2);
            let w = m.photometric_weight * k * k;
            cost += m.photometric_weight * 0.5 * e2 * k;
            if e2 < 9.0 {
                photometric_square[0] += r * r;
                photometric_square[1] += 1.0;
            }
            let (gx, gy) = (s[1] * level.fx * iz * inv, s[2] * level.fy * iz * inv);
            let g = [gx, gy, -(gx * x + gy * y)];
            let c = cross(rp, g);
            let j = [g[0], g[1], g[2], c[0], c[1], c[2], -point.intensity * inv, -inv];
            accumulate(&mut h, &mut b, &j, w, e);
        }
    }
    for i in 0..8 {
        for j in 0..8 {
            out.h[i][j] = f64::from(h[i][j]);
        }
        out.b[i] = f64::from(b[i]);
    }
    out.cost = f64::from(cost);
    out.fixed_cost = f64::from(fixed);
    out.geometric_square = geometric_square.map(f64::from);
    out.photometric_square = photometric_square.map(f64::from);
    out
}

#[inline(always)]
fn accumulate(h: &mut [[f32; 8]; 8], b: &mut [f32; 8], j: &[f32; 8], w: f32, e: f32) {
    for i in 0..8 {
        let wj = w * j[i];
        for k in 0..8 {
            h[i][k] += wj * j[k];
        }
    }
    let we = w * e;
    for k in 0..8 {
        b[k] += we * j[k];
    }
}

#[inline(always)]
fn sqrt(x: f32) -> f32 {
    num_traits::Float::sqrt(x)
}
