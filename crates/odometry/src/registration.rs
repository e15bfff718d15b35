//! Where the colour image lies on the depth image.
//!
//! Recordings often pretend that colour and depth share one camera. When the colour camera has
//! another focal length or centre, its image slides over the surfaces as the camera moves, which
//! pulls every photometric alignment. Depth alone gives the motion between keyframes; with it, the
//! scale that makes their colours agree best is found here by search: no derivative could be
//! trusted as long as the images disagree. A shift is not looked for: it moves both colours of a
//! surface alike, so nothing shows it (and nothing suffers from it).
use super::pyramid::{RgbdPyramid, halve_intensity};
use alloc::{borrow::Cow, vec::Vec};
use glam::DVec3;
use mte_slam_types::{camera::Camera, classes::UNLABELLED, frame::Frame, pose::Pose};
use serde::{Deserialize, Serialize};

/// Maps a pixel of the depth image to the colour image: `centre + scale (pixel - centre)`, with the
/// principal point as the centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColourRegistration {
    /// Focal length of the colour camera over that of the depth camera.
    pub scale: f64,
}

impl Default for ColourRegistration {
    fn default() -> Self {
        Self { scale: 1.0 }
    }
}

impl ColourRegistration {
    /// Largest distance between what this and `other` make of a pixel, in an image that reaches
    /// `radius` pixels from the principal point.
    pub fn distance(&self, other: &ColourRegistration, radius: f64) -> f64 {
        (self.scale - other.scale).abs() * radius
    }

    /// Whether colour and depth share their pixels, as far as known.
    pub fn is_identity(&self) -> bool {
        self.scale == 1.0
    }

    /// The frame with colour (bilinear) and labels (nearest; they are taken to be made from the
    /// colour image) resampled into the depth camera's pixels. Where the colour image does not
    /// reach (`scale` above 1), its border is repeated and the label is [`UNLABELLED`].
    ///
    /// The frame itself when both cameras are one. Its images must have the camera's size.
    pub fn registered<'a>(&self, frame: &'a Frame, camera: &Camera) -> Cow<'a, Frame> {
        if self.is_identity() {
            return Cow::Borrowed(frame);
        }
        let mut out = frame.clone();
        let words: Vec<[u8; 4]> = (frame.color.iter().enumerate())
            .map(|(i, c)| {
                [c[0], c[1], c[2], frame.labels.as_ref().map_or(UNLABELLED, |labels| labels[i])]
            })
            .collect();
        for (i, [r, g, b, label]) in self.resampled(&words, camera).into_iter().enumerate() {
            out.color[i] = [r, g, b];
            if let Some(labels) = &mut out.labels {
                labels[i] = label;
            }
        }
        Cow::Owned(out)
    }

    /// The same for an image of colour and label.
    pub fn resampled(&self, image: &[[u8; 4]], camera: &Camera) -> Vec<[u8; 4]> {
        let (w, h) = (camera.width as usize, camera.height as usize);
        let along = |centre: f64, pixel: usize, end: usize| {
            let at = centre + self.scale * (pixel as f64 - centre);
            let inside = at > -0.5 && at < end as f64 - 0.5;
            let at = at.clamp(0.0, (end - 1) as f64);
            let first = (at as usize).min(end.saturating_sub(2));
            (first, (first + 1).min(end - 1), at - first as f64, inside)
        };
        let mut out = Vec::with_capacity(w * h);
        for v in 0..h {
            let (top, bottom, fv, inside_v) = along(camera.cy, v, h);
            for u in 0..w {
                let (left, right, fu, inside_u) = along(camera.cx, u, w);
                let near =
                    [[top, bottom][usize::from(fv > 0.5)], [left, right][usize::from(fu > 0.5)]];
                let label =
                    if inside_u && inside_v { image[near[0] * w + near[1]][3] } else { UNLABELLED };
                let mut pixel = [0, 0, 0, label];
                for (k, value) in pixel[..3].iter_mut().enumerate() {
                    let at = |v: usize, u: usize| f64::from(image[v * w + u][k]);
                    let a = at(top, left) + fu * (at(top, right) - at(top, left));
                    let b = at(bottom, left) + fu * (at(bottom, right) - at(bottom, left));
                    *value = (a + fv * (b - a) + 0.5) as u8;
                }
                out.push(pixel);
            }
        }
        out
    }
}

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

    /// Value at a pixel position, bilinear; `None` outside.
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

    /// Mean robust cost a match.
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

/// The registration under which the pairs' colours agree best; the identity unless it explains
/// clearly more than the identity does.
pub(super) fn estimate(pairs: &[Pair<'_>]) -> ColourRegistration {
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
        ColourRegistration { scale: best.1 }
    } else {
        ColourRegistration::default()
    }
}
