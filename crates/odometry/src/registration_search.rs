//! The search for the scale of colour on depth. Depth alone gives the motion between keyframes;
//! with it, the scale that makes their colours agree best is found by trial: no derivative could
//! be trusted as long as the images disagree.
use super::{
    pyramid::{RgbdPyramid, halve_intensity},
    registration::ColorRegistration,
};
use alloc::vec::Vec;
use glam::DVec3;
use mte_slam_types::pose::Pose;

/// Two frames whose relative pose depth alone has given.
pub(super) struct Pair<'a> {
    pub reference: &'a RgbdPyramid,
    pub current: &'a RgbdPyramid,
    pub reference_from_current: Pose,
}

/// Scales tried on either side of one.
const STEPS: i32 = 20;
/// Between scales tried first: a pixel at the border of a 120 pixel wide image.
const STEP: f64 = 0.01;
/// Narrowings of the search around the best scale, each to a third.
const REFINEMENTS: usize = 3;
/// Most points of a pair.
const POINTS: usize = 1500;
/// The cost must fall to this share for a registration to be believed over none.
const GAIN: f64 = 0.8;

struct Image {
    data: Vec<f32>,
    width: usize,
    height: usize,
}

impl Image {
    fn new(pyramid: &RgbdPyramid, level: usize) -> Image {
        let mut image = Image {
            data: pyramid.intensity.clone(),
            width: pyramid.levels[0].width,
            height: pyramid.levels[0].height,
        };
        for _ in 0..level {
            image = Image {
                data: halve_intensity(&image.data, image.width, image.height),
                width: image.width / 2,
                height: image.height / 2,
            };
        }
        image
    }

    /// Returns the value at a pixel position, bilinear; `None` outside.
    fn sample(&self, u: f64, v: f64) -> Option<f64> {
        let inside =
            u >= 0.0 && v >= 0.0 && u < self.width as f64 - 1.0 && v < self.height as f64 - 1.0;
        if !inside {
            return None;
        }
        let (x, y) = (u as usize, v as usize);
        let (a, b) = (u - x as f64, v - y as f64);
        let i = y * self.width + x;
        let at = |i: usize| f64::from(self.data[i]);
        let top = at(i) + a * (at(i + 1) - at(i));
        let i = i + self.width;
        Some(top + b * (at(i) + a * (at(i + 1) - at(i)) - top))
    }
}

/// Pixel positions, relative to the principal point, of the same surface in both depth images.
fn matches(pair: &Pair<'_>, level: usize) -> Vec<[f64; 4]> {
    let (a, b) = (&pair.reference.levels[level], &pair.current.levels[level]);
    let mut step = b.points.len().div_ceil(POINTS).max(1);
    while step > 1 && b.width.is_multiple_of(step) {
        step += 1;
    }
    let mut out = Vec::with_capacity(b.points.len() / step + 1);
    for point in b.points.iter().step_by(step) {
        let [x, y, z] = point.p.map(f64::from);
        let q = pair.reference_from_current.transform_point(DVec3::new(x, y, z));
        if q.z < 0.05 {
            continue;
        }
        let (fx, fy) = (f64::from(a.fx), f64::from(a.fy));
        let (ua, va) = (fx * q.x / q.z, fy * q.y / q.z);
        let (u, v) = (ua + f64::from(a.cx) + 0.5, va + f64::from(a.cy) + 0.5);
        if !(u >= 0.0 && v >= 0.0 && u < a.width as f64 && v < a.height as f64) {
            continue;
        }
        let found = f64::from(a.texels[v as usize * a.width + u as usize][3]);
        if found > 0.0 && (found - q.z).abs() < 0.03 * q.z {
            out.push([ua, va, fx * x / z, fy * y / z]);
        }
    }
    out
}

struct Prepared {
    reference: Image,
    current: Image,
    matches: Vec<[f64; 4]>,
    /// Principal points of reference and current.
    centres: [f64; 4],
    /// Robust standard deviation of the differences without registration.
    sigma: f64,
}

impl Prepared {
    fn new(pair: &Pair<'_>, level: usize) -> Prepared {
        let (a, b) = (&pair.reference.levels[level], &pair.current.levels[level]);
        let mut out = Prepared {
            reference: Image::new(pair.reference, level),
            current: Image::new(pair.current, level),
            matches: matches(pair, level),
            centres: [a.cx, a.cy, b.cx, b.cy].map(f64::from),
            sigma: 1.0,
        };
        let sizes = out.differences(1.0).iter().map(|d| d.abs()).collect();
        out.sigma = (1.4826 * median(sizes)).max(0.002);
        out
    }

    /// Colour differences of the matches, less their median (exposure).
    fn differences(&self, scale: f64) -> Vec<f64> {
        let [ax, ay, bx, by] = self.centres;
        let mut out = Vec::with_capacity(self.matches.len());
        for [ua, va, ub, vb] in &self.matches {
            let a = self.reference.sample(ax + scale * ua, ay + scale * va);
            let b = self.current.sample(bx + scale * ub, by + scale * vb);
            if let (Some(a), Some(b)) = (a, b) {
                out.push(a - b);
            }
        }
        let middle = median(out.clone());
        for d in &mut out {
            *d -= middle;
        }
        out
    }

    /// Returns the mean robust cost per match.
    fn cost(&self, scale: f64) -> f64 {
        let list = self.differences(scale);
        let width = 6.0 * self.sigma * self.sigma;
        list.iter().map(|d| d * d / (d * d + width)).sum::<f64>() / list.len().max(1) as f64
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let k = values.len() / 2;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

/// Returns the registration under which the pairs' colours agree best; the identity unless it explains
/// clearly more than the identity does.
pub(super) fn estimate(pairs: &[Pair<'_>]) -> ColorRegistration {
    let levels = pairs.iter().flat_map(|p| [p.reference, p.current]).map(|p| p.levels.len());
    let level = levels.min().unwrap_or(1).min(2) - 1;
    let prepared = pairs.iter().map(|p| Prepared::new(p, level)).collect::<Vec<Prepared>>();
    let cost = |scale: f64| prepared.iter().map(|p| p.cost(scale)).sum::<f64>();
    // Interpolation takes noise away, which flatters any other scale than one: compare with
    // neighbours of one that are interpolated, too.
    let without = cost(1.0).min(cost(1.0 - STEP)).min(cost(1.0 + STEP));
    let mut best = (without, 1.0);
    let mut step = STEP;
    let mut reach = STEPS;
    for _ in 0..=REFINEMENTS {
        let middle = best.1;
        for i in -reach..=reach {
            let scale = middle + f64::from(i) * step;
            let c = cost(scale);
            if c < best.0 {
                best = (c, scale);
            }
        }
        step /= 3.0;
        reach = 2;
    }
    if best.0 < GAIN * without {
        ColorRegistration { scale: best.1 }
    } else {
        ColorRegistration::default()
    }
}
