//! Tiny blurred images to guess which keyframe a lost camera sees.
use super::pyramid::RgbdPyramid;
use alloc::vec::Vec;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// A blurred image of about 40x30 with zero mean and unit length.
#[derive(Clone, Debug)]
pub(super) struct Thumbnail {
    values: Vec<f32>,
}

impl Thumbnail {
    pub fn new(pyramid: &RgbdPyramid) -> Thumbnail {
        let level = pyramid
            .levels
            .iter()
            .find(|l| l.width <= 48)
            .unwrap_or(&pyramid.levels[pyramid.levels.len() - 1]);
        let (w, h) = (level.width, level.height);
        let mut values = Vec::with_capacity(w * h);
        for v in 0..h {
            for u in 0..w {
                let (mut sum, mut n) = (0.0, 0.0);
                for y in v.saturating_sub(1)..(v + 2).min(h) {
                    for x in u.saturating_sub(1)..(u + 2).min(w) {
                        sum += level.texels[y * w + x][0];
                        n += 1.0;
                    }
                }
                values.push(sum / n);
            }
        }
        let mean = values.iter().sum::<f32>() / values.len().max(1) as f32;
        values.iter_mut().for_each(|x| *x -= mean);
        let length = values.iter().map(|x| x * x).sum::<f32>().sqrt().max(1e-6);
        values.iter_mut().for_each(|x| *x /= length);
        Thumbnail { values }
    }

    /// Correlation, -1..1.
    pub fn similarity(&self, other: &Thumbnail) -> f32 {
        self.values.iter().zip(&other.values).map(|(a, b)| a * b).sum()
    }
}
