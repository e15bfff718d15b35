//! What a sequence delivers.
use crate::{camera::Camera, classes::ClassTable, pose::Pose};
use alloc::{string::String, vec::Vec};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// An axis-aligned box in world coordinates \[m\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Smallest corner \[m\].
    pub min: DVec3,
    /// Largest corner \[m\].
    pub max: DVec3,
}

/// One RGB-D frame, row-major from the top left. All images have the size of the camera.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Position in the sequence as read (after `--start` and `--stride`).
    pub index: usize,
    /// The data set's own frame number.
    pub number: u64,
    /// Time stamp of the data set \[s\], or the frame number when it has none.
    pub time_s: f64,
    /// sRGB colour.
    pub color: Vec<[u8; 3]>,
    /// Depth along z in units of `SequenceInfo::depth_unit_m`; 0 is invalid.
    pub depth: Vec<u16>,
    /// Compact class indices ([`crate::classes::UNLABELLED`] where unknown), when there are labels.
    pub labels: Option<Vec<u8>>,
    /// Ground-truth `world_from_camera`, when known and finite.
    pub truth: Option<Pose>,
    /// Features of the colour image made elsewhere, when the sequence has them.
    pub features: Option<FeatureMap>,
}

/// Most channels of a feature map.
pub const MAX_FEATURE_CHANNELS: usize = 4096;

/// Features that a model (such as DINOv2) made of the whole colour image, on a grid of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureMap {
    /// Channels.
    pub channels: usize,
    /// Rows of the grid.
    pub height: usize,
    /// Columns of the grid.
    pub width: usize,
    /// Values, channels x height x width.
    pub values: Vec<f32>,
}

impl FeatureMap {
    /// Returns the features on a grid of `columns` x `rows` cells that cover the part from 0 to `extent`
    /// (shares of width and height) of the image: bilinear between the map's cell centres. A cell's
    /// channels lie side by side and are scaled to a mean square of 1, for models differ in size.
    pub fn resampled(&self, columns: usize, rows: usize, extent: [f32; 2]) -> Vec<f32> {
        let (h, w) = (self.height, self.width);
        // Lower neighbour and share of the upper one.
        let place = |i: usize, n: usize, extent: f32, size: usize| {
            let x = (i as f32 + 0.5) / n as f32 * extent * size as f32 - 0.5;
            let x = x.clamp(0.0, (size - 1) as f32);
            let low = (x as usize).min(size.saturating_sub(2));
            (low, (low + 1).min(size - 1), x - low as f32)
        };
        let mut out = Vec::with_capacity(columns * rows * self.channels);
        for row in 0..rows {
            let (top, bottom, v) = place(row, rows, extent[1], h);
            for column in 0..columns {
                let (left, right, u) = place(column, columns, extent[0], w);
                let first = out.len();
                for plane in self.values.chunks_exact(h * w) {
                    let line =
                        |y: usize| plane[y * w + left] * (1.0 - u) + plane[y * w + right] * u;
                    out.push(line(top) * (1.0 - v) + line(bottom) * v);
                }
                let cell = &mut out[first..];
                let square = cell.iter().map(|x| x * x).sum::<f32>() / cell.len().max(1) as f32;
                let scale = 1.0 / num_traits::Float::sqrt(square).max(1e-6);
                cell.iter_mut().for_each(|x| *x *= scale);
            }
        }
        out
    }
}

/// What is the same for all frames of a sequence.
#[derive(Clone, Debug)]
pub struct SequenceInfo {
    /// Name shown to people, for example the folder's name.
    pub name: String,
    /// Name of the layout, for example `replica`, `tum`, `7scenes`, `synthetic`.
    pub layout: &'static str,
    /// Pinhole camera of the (scaled, undistorted) images.
    pub camera: Camera,
    /// Metres per unit of `Frame::depth`.
    pub depth_unit_m: f64,
    /// Number of frames that `frame` accepts.
    pub frames: usize,
    /// Classes of the labels; empty without labels.
    pub classes: ClassTable,
    /// Channels of the frames' feature maps; 0 without.
    pub feature_channels: usize,
    /// Scene bounds \[m\] in the ground truth's world frame, when the data set gives them.
    pub bounds: Option<Bounds>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feature_maps_are_resampled_where_they_lie() {
        // Two channels: the column of the map, and 1.
        let mut values: Vec<f32> = (0..12).map(|i| (i % 4) as f32).collect();
        values.extend([1.0; 12]);
        let map = FeatureMap { channels: 2, height: 3, width: 4, values };
        let ratio = |cells: &[f32]| cells.chunks_exact(2).map(|c| c[0] / c[1]).collect::<Vec<_>>();
        let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        let same = map.resampled(4, 3, [1.0, 1.0]);
        assert!(near(&ratio(&same), &[0.0, 1.0, 2.0, 3.0].repeat(3)), "{same:?}");
        assert!(same.chunks_exact(2).all(|c| (c[0] * c[0] + c[1] * c[1] - 2.0).abs() < 1e-4));
        let half = map.resampled(2, 1, [1.0, 1.0]);
        assert!(near(&ratio(&half), &[0.5, 2.5]), "{half:?}");
        // The left half alone, and beyond the outermost centres.
        let left = map.resampled(4, 1, [0.5, 1.0]);
        assert!(near(&ratio(&left), &[0.0, 0.25, 0.75, 1.25]), "{left:?}");
        let one = FeatureMap { channels: 1, height: 1, width: 1, values: alloc::vec![-3.0] };
        assert!(near(&one.resampled(3, 2, [1.0, 1.0]), &[-1.0; 6]));
    }
}
