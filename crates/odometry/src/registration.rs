//! Where the colour image lies on the depth image.
//!
//! Recordings often pretend that colour and depth share one camera. When the colour camera has
//! another focal length or centre, its image slides over the surfaces as the camera moves, which
//! pulls every photometric alignment. A shift is not looked for: it moves both colours of a
//! surface alike, so nothing shows it (and nothing suffers from it).
use alloc::{borrow::Cow, vec::Vec};
use mte_slam_types::{camera::Camera, classes::UNLABELLED, frame::Frame};
use serde::{Deserialize, Serialize};

/// Maps a pixel of the depth image to the colour image: `centre + scale (pixel - centre)`, with the
/// principal point as the centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColorRegistration {
    /// Focal length of the colour camera over that of the depth camera.
    pub scale: f64,
}

impl Default for ColorRegistration {
    fn default() -> Self {
        Self { scale: 1.0 }
    }
}

impl ColorRegistration {
    /// Returns the largest distance between what this and `other` make of a pixel, in an image that reaches
    /// `radius` pixels from the principal point.
    pub fn distance(&self, other: &ColorRegistration, radius: f64) -> f64 {
        (self.scale - other.scale).abs() * radius
    }

    /// Returns whether colour and depth share their pixels, as far as known.
    pub fn is_identity(&self) -> bool {
        self.scale == 1.0
    }

    /// Returns the frame with colour (bilinear) and labels (nearest; they are taken to be made from the
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

    /// Returns the same for an image of colour and label.
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
