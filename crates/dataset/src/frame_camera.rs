//! Frames with a camera of their own, such as those of phones whose lens moves to focus. No
//! rotation lies between two cameras of one place, so that images of one become those of the
//! other by a factor and a shift of each axis.
use super::decode::Size;
use mte_slam_types::camera::Camera;

/// Images that would move by less than this everywhere stay as they are \[pixels\].
pub(super) const LEAST_PIXELS: f64 = 0.5;

/// Where the pixels of the common camera lie in a frame's own images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    factor: [f64; 2],
    shift: [f64; 2],
}

impl Fit {
    /// From the common camera to a frame's own, of images of the same size.
    pub fn new(common: &Camera, own: &Camera) -> Fit {
        let factor = [own.fx / common.fx, own.fy / common.fy];
        let shift = [own.cx - factor[0] * common.cx, own.cy - factor[1] * common.cy];
        Fit { factor, shift }
    }

    fn place(&self, axis: usize, pixel: u32) -> f64 {
        self.factor[axis] * f64::from(pixel) + self.shift[axis]
    }

    /// How far a pixel moves, at most.
    pub fn farthest(&self, size: Size) -> f64 {
        // Affine along each axis, so that the ends move most.
        let moved = |axis: usize, side: u32| {
            let end = |pixel: u32| (self.place(axis, pixel) - f64::from(pixel)).abs();
            end(0).max(end(side - 1))
        };
        moved(0, size.0).hypot(moved(1, size.1))
    }

    /// For each pixel of one axis where it lies, or `None` outside the image.
    fn places(&self, axis: usize, side: u32) -> Vec<Option<f64>> {
        let last = f64::from(side - 1);
        let inside = |x: &f64| *x >= -0.5 && *x < last + 0.5;
        let place = |i| Some(self.place(axis, i)).filter(inside).map(|x| x.clamp(0.0, last));
        (0..side).map(place).collect()
    }

    /// Nearest pixel, for depth and labels; `hole` where the frame's own image shows nothing.
    pub fn nearest<T: Copy>(&self, image: &[T], size: Size, hole: T) -> Vec<T> {
        let whole = |x: Option<f64>| x.map(|x| x.round() as usize);
        let columns: Vec<_> = self.places(0, size.0).into_iter().map(whole).collect();
        let mut out = Vec::with_capacity(image.len());
        for y in self.places(1, size.1).into_iter().map(whole) {
            let at = |x: &Option<usize>| Some(image[y? * size.0 as usize + (*x)?]);
            out.extend(columns.iter().map(|x| at(x).unwrap_or(hole)));
        }
        out
    }

    /// Bilinear, for color; the border goes on outside.
    pub fn bilinear(&self, image: &[[u8; 3]], size: Size) -> Vec<[u8; 3]> {
        // First neighbor, second, and share of the second.
        let between = |axis: usize, side: u32| -> Vec<(usize, usize, f32)> {
            let last = f64::from(side - 1);
            let one = |i| {
                let x = self.place(axis, i).clamp(0.0, last);
                (x as usize, (x as usize + 1).min(side as usize - 1), x.fract() as f32)
            };
            (0..side).map(one).collect()
        };
        let columns = between(0, size.0);
        let mut out = Vec::with_capacity(image.len());
        for (top, bottom, b) in between(1, size.1) {
            let row = |y: usize| &image[y * size.0 as usize..][..size.0 as usize];
            let (top, bottom) = (row(top), row(bottom));
            out.extend(columns.iter().map(|&(left, right, a)| -> [u8; 3] {
                core::array::from_fn(|c| {
                    let mix = |r: &[[u8; 3]]| {
                        f32::from(r[left][c]) * (1.0 - a) + f32::from(r[right][c]) * a
                    };
                    (mix(top) * (1.0 - b) + mix(bottom) * b + 0.5) as u8
                })
            }));
        }
        out
    }
}

/// Returns the median of each of some cameras' numbers.
pub(super) fn median(cameras: &[[f64; 4]]) -> Option<[f64; 4]> {
    if cameras.is_empty() {
        return None;
    }
    Some(core::array::from_fn(|i| {
        let mut values: Vec<f64> = cameras.iter().map(|c| c[i]).collect();
        *values.select_nth_unstable_by((cameras.len() - 1) / 2, f64::total_cmp).1
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMMON: Camera = Camera { width: 40, height: 30, fx: 50., fy: 52., cx: 19., cy: 14.5 };

    /// A picture that depends on the ray alone.
    fn picture(c: &Camera) -> (Vec<[u8; 3]>, Vec<u16>) {
        let rays = (0..c.height).flat_map(|y| (0..c.width).map(move |x| (x, y)));
        let rays = rays.map(|(x, y)| c.back_project(x.into(), y.into(), 1.0));
        let color = rays.clone().map(|r| [128.0 + 200.0 * r.x, 128.0 + 200.0 * r.y, 90.0]);
        let color = color.map(|c| c.map(|v| v.round() as u8)).collect();
        (color, rays.map(|r| (5000.0 + 4000.0 * r.x + 2000.0 * r.y) as u16).collect())
    }

    #[test]
    fn images_of_another_camera_become_those_of_the_common_one() {
        let own = Camera { fx: 55.0, fy: 49.0, cx: 21.25, cy: 13.0, ..COMMON };
        let (fit, size) = (Fit::new(&COMMON, &own), (COMMON.width, COMMON.height));
        let ((want_color, want_depth), (color, depth)) = (picture(&COMMON), picture(&own));
        let (color, depth) = (fit.bilinear(&color, size), fit.nearest(&depth, size, 0));
        let mut holes = 0;
        for i in 0..want_depth.len() {
            let (x, y) = (i as u32 % 40, i as u32 / 40);
            let (u, v) = (fit.place(0, x), fit.place(1, y));
            let inside = u >= -0.5 && v >= -0.5 && u < 39.5 && v < 29.5;
            assert_eq!(depth[i] == 0, !inside, "{x} {y}");
            holes += usize::from(!inside);
            if inside {
                // Half a pixel of the slopes.
                assert!(depth[i].abs_diff(want_depth[i]) <= 62, "{x} {y}");
            }
            if u >= 0.0 && v >= 0.0 && u <= 39.0 && v <= 29.0 {
                let off = (0..3).map(|c| color[i][c].abs_diff(want_color[i][c])).max();
                assert!(off <= Some(1), "{x} {y}: {:?} {:?}", color[i], want_color[i]);
            }
        }
        assert!((50..400).contains(&holes), "{holes}");
        let far = Fit::new(&COMMON, &Camera { cx: 1e9, ..COMMON });
        assert!(far.nearest(&depth, size, 7).iter().all(|d| *d == 7));
        assert_eq!(far.bilinear(&color, size).len(), 1200);
    }

    #[test]
    fn the_median_of_each_number_is_the_common_camera() {
        let cameras = [[1.0, 9.0, 5.0, 0.0], [3.0, 7.0, 5.0, 1.0], [2.0, 8.0, 4.0, 2.0]];
        assert_eq!(median(&cameras), Some([2.0, 8.0, 5.0, 1.0]));
        assert_eq!(median(&cameras[..2]), Some([1.0, 7.0, 5.0, 0.0]));
        assert_eq!(median(&[]), None);
    }
}
