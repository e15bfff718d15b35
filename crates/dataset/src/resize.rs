//! Changing the size of images, with the camera that belongs to the result.
use super::decode::Size;
use mte_slam_types::camera::Camera;

/// Width over height of two images of one scene may differ by this share.
pub(super) const ASPECT_TOLERANCE: f64 = 0.03;

/// Returns whether one size is the other, enlarged, within a tolerance.
pub(super) fn same_aspect(a: Size, b: Size) -> bool {
    let aspect = |s: Size| f64::from(s.0) / f64::from(s.1);
    (aspect(a) / aspect(b) - 1.0).abs() <= ASPECT_TOLERANCE
}

/// One axis of a resize: `from` pixels become `to`, each `ratio` wide.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    from: u32,
    to: u32,
    ratio: f64,
}

impl Axis {
    /// Returns the pixel at the centre of output pixel `i`; of two equally near ones the first, so that
    /// an integer ratio `step` gives `step * i + (step - 1) / 2`.
    fn nearest(&self, i: u32) -> usize {
        let centre = (f64::from(i) + 0.5) * self.ratio - 0.5;
        // A little less than the exact half, so that rounding errors do not decide.
        ((centre - 0.5 - 1e-9).ceil().max(0.0) as u32).min(self.from - 1) as usize
    }

    /// First input pixel and weights (summing to 1) of the interval that output pixel `i` covers.
    fn cover(&self, i: u32) -> (usize, Vec<f32>) {
        let end = f64::from(self.from);
        let low = (f64::from(i) * self.ratio).min(end - 1e-6);
        let high = (low + self.ratio).min(end);
        let (first, last) = (low.floor() as usize, (high - 1e-9).max(low).floor() as usize);
        let part = |p: usize| (high.min(p as f64 + 1.0) - low.max(p as f64)).max(0.0);
        let total: f64 = (first..=last).map(part).sum();
        (first, (first..=last).map(|p| (part(p) / total) as f32).collect())
    }
}

/// A resize of whole images from one size to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Resize {
    x: Axis,
    y: Axis,
}

impl Resize {
    /// To an exact size.
    pub fn to_size(from: Size, to: Size) -> Self {
        let axis = |from: u32, to: u32| Axis { from, to, ratio: f64::from(from) / f64::from(to) };
        Self { x: axis(from.0, to.0), y: axis(from.1, to.1) }
    }

    /// By a factor in (0, 1]. When 1/scale is an integer, whole blocks are used and left-over
    /// columns and rows dropped, as in [`Camera::downscaled`].
    pub fn by_scale(from: Size, scale: f64) -> Self {
        let step = (1.0 / scale).round();
        if (1.0 / scale - step).abs() < 1e-6 * step {
            let axis =
                |n: u32| Axis { from: n, to: ((f64::from(n) / step) as u32).max(1), ratio: step };
            return Self { x: axis(from.0), y: axis(from.1) };
        }
        let scaled = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
        Self::to_size(from, (scaled(from.0), scaled(from.1)))
    }

    /// Returns the size of the result.
    pub fn size(&self) -> Size {
        (self.x.to, self.y.to)
    }

    /// Returns whether nothing changes.
    pub fn is_identity(&self) -> bool {
        self.x.from == self.x.to && self.y.from == self.y.to
    }

    /// Returns the camera of the result; pixel centres lie at whole numbers, so a pixel coordinate u
    /// becomes (u + 1/2) / ratio - 1/2.
    pub fn camera(&self, c: &Camera) -> Camera {
        Camera {
            width: self.x.to,
            height: self.y.to,
            fx: c.fx / self.x.ratio,
            fy: c.fy / self.y.ratio,
            cx: (c.cx + 0.5) / self.x.ratio - 0.5,
            cy: (c.cy + 0.5) / self.y.ratio - 0.5,
        }
    }

    /// Nearest pixel, for depth and labels.
    pub fn nearest<T: Copy>(&self, image: &[T]) -> Vec<T> {
        let columns: Vec<usize> = (0..self.x.to).map(|i| self.x.nearest(i)).collect();
        let width = self.x.from as usize;
        let mut out = Vec::with_capacity(columns.len() * self.y.to as usize);
        for y in 0..self.y.to {
            let row = &image[self.y.nearest(y) * width..][..width];
            out.extend(columns.iter().map(|&x| row[x]));
        }
        out
    }

    /// Average over the area that each output pixel covers, for colour.
    pub fn average(&self, image: &[[u8; 3]]) -> Vec<[u8; 3]> {
        let (width, out_width) = (self.x.from as usize, self.x.to as usize);
        let columns: Vec<_> = (0..self.x.to).map(|i| self.x.cover(i)).collect();
        let mut out = Vec::with_capacity(out_width * self.y.to as usize);
        let mut column_sums = vec![[0f32; 3]; width];
        for y in 0..self.y.to {
            let (first, weights) = self.y.cover(y);
            column_sums.fill([0.0; 3]);
            for (k, &w) in weights.iter().enumerate() {
                let row = &image[(first + k) * width..][..width];
                for (sum, pixel) in column_sums.iter_mut().zip(row) {
                    for c in 0..3 {
                        sum[c] += w * f32::from(pixel[c]);
                    }
                }
            }
            out.extend(columns.iter().map(|(first, weights)| {
                let mut sum = [0.5f32; 3];
                for (w, column) in weights.iter().zip(&column_sums[*first..]) {
                    for c in 0..3 {
                        sum[c] += w * column[c];
                    }
                }
                sum.map(|v| v as u8)
            }));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera = Camera { width: 11, height: 9, fx: 7.0, fy: 8.0, cx: 5.2, cy: 3.9 };

    #[test]
    fn integer_ratios_agree_with_camera_downscaled() {
        for step in 1..5 {
            let r = Resize::by_scale((11, 9), 1.0 / f64::from(step));
            let (a, b) = (r.camera(&CAMERA), CAMERA.downscaled(step));
            assert_eq!((a.width, a.height), (b.width, b.height));
            assert!((a.cx - b.cx).abs() < 1e-12 && (a.fy - b.fy).abs() < 1e-12);
            let image: Vec<u32> = (0..99).collect();
            let got = r.nearest(&image);
            let pick = |i: u32| step * i + (step - 1) / 2;
            for y in 0..b.height {
                for x in 0..b.width {
                    assert_eq!(got[(y * b.width + x) as usize], pick(y) * 11 + pick(x));
                }
            }
        }
    }

    #[test]
    fn averages_keep_constants_and_means() {
        let flat = vec![[255, 1, 128]; 99];
        let ramp: Vec<[u8; 3]> = (0..99).map(|i| [(i % 11) * 20; 3]).collect();
        for scale in [1.0, 0.7, 0.5, 0.37, 0.3, 0.05] {
            let r = Resize::by_scale((11, 9), scale);
            let n = r.size().0 as usize * r.size().1 as usize;
            assert_eq!(r.average(&flat), vec![[255, 1, 128]; n], "{scale}");
            assert_eq!(r.nearest(&flat).len(), n);
        }
        let thirds = Resize::by_scale((11, 9), 1.0 / 3.0).average(&ramp);
        assert_eq!(&thirds[..3], [[20; 3], [80; 3], [140; 3]]);
        // 11 -> 8 columns: the first covers pixel 0 and 3/8 of pixel 1.
        let general = Resize::to_size((11, 9), (8, 9)).average(&ramp);
        assert_eq!(general[0], [(0.375 * 20.0 / 1.375f64).round() as u8; 3]);
        // Colour may also be smaller than depth.
        assert_eq!(Resize::to_size((11, 9), (22, 18)).average(&flat).len(), 22 * 18);
    }

    #[test]
    fn a_point_keeps_its_place_under_a_general_ratio() {
        let r = Resize::by_scale((640, 480), 0.37);
        let camera = Camera { width: 640, height: 480, fx: 525., fy: 525., cx: 319.5, cy: 239.5 };
        let small = r.camera(&camera);
        assert_eq!((small.width, small.height), (237, 178));
        // The left edge of the image, at -1/2, stays its left edge.
        let ray = camera.back_project(-0.5, -0.5, 2.0);
        let back = small.project(ray).unwrap();
        assert!((back.x + 0.5).abs() < 1e-9 && (back.y + 0.5).abs() < 1e-9, "{back}");
    }
}
