//! How well the outlines of classes are met, which mIoU, dominated by interiors, hardly shows.
use super::MetricsError;
use alloc::{format, string::String, vec, vec::Vec};
use mte_slam_types::classes::UNLABELLED;
use serde::Serialize;

/// Width of the band along an outline, and tolerance of the F-score \[pixels\].
pub const BOUNDARY_PIXELS: usize = 2;
/// What does not count: pixels without a true class, in both images.
const IGNORED: u8 = UNLABELLED;

/// Counts along the outlines of true and predicted classes.
///
/// Pixels without a true class are taken out of both images: they are neither counted nor make an
/// outline, and neither does the edge of the image, beyond which nothing is known. A predicted
/// pixel without a class does make one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BoundaryMeter {
    classes: usize,
    of_class: Vec<Counts>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    /// Pixels in the band: of the truth, of the prediction, of both.
    true_band: u64,
    predicted_band: u64,
    both_bands: u64,
    /// Outline pixels, and those with one of the other image within the tolerance.
    true_outline: u64,
    true_met: u64,
    predicted_outline: u64,
    predicted_met: u64,
}

/// Figures of a [`BoundaryMeter`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoundaryReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]).
    pub protocol_id: String,
    /// What the figures mean.
    pub protocol: String,
    /// Mean boundary IoU \[%\] over the classes that have an outline in truth or prediction.
    pub iou_percent: f64,
    /// Mean F-score \[%\] over the same classes.
    pub f_score_percent: f64,
    /// Number of classes in both means.
    pub classes: usize,
    /// Boundary IoU \[%\] of each compact class index; `None` without any outline.
    #[serde(skip)]
    pub iou_percent_of_class: Vec<Option<f64>>,
    /// F-score \[%\] of each compact class index; `None` without any outline.
    #[serde(skip)]
    pub f_score_percent_of_class: Vec<Option<f64>>,
}

impl BoundaryMeter {
    /// No counts yet, for compact classes 0..`classes`.
    pub fn new(classes: usize) -> BoundaryMeter {
        BoundaryMeter { classes, of_class: vec![Counts::default(); classes] }
    }

    /// Adds an image of compact class indices, `width` pixels per row.
    ///
    /// # Errors
    /// Images of different size, or no whole number of rows.
    pub fn add(
        &mut self,
        width: usize,
        truth: &[u8],
        predicted: &[u8],
    ) -> Result<(), MetricsError> {
        let (found, expected) = (predicted.len(), truth.len());
        if found != expected {
            return Err(MetricsError::Size { what: "rendered class pixels", found, expected });
        }
        if width == 0 || !truth.len().is_multiple_of(width) {
            let (found, expected) = (truth.len(), width);
            return Err(MetricsError::Size { what: "pixels, of rows this long", found, expected });
        }
        // 254 stands for "no class": the table has at most 255 classes, of which the last one
        // would share it; it then only loses its outline to holes.
        let n = self.classes.min(usize::from(IGNORED)) as u8;
        let none = n.min(IGNORED - 1);
        let t: Vec<u8> = truth.iter().map(|&t| if t < n { t } else { IGNORED }).collect();
        let p: Vec<u8> = predicted
            .iter()
            .zip(&t)
            .map(|(&p, &t)| match t {
                IGNORED => IGNORED,
                _ if p < n => p,
                _ => none,
            })
            .collect();
        let bands = [near_other(&t, width, true), near_other(&p, width, true)];
        let outlines = [near_other(&t, width, false), near_other(&p, width, false)];
        for i in 0..t.len() {
            let (tc, pc) = (usize::from(t[i]), usize::from(p[i]));
            let (tb, pb) = (bands[0][i], bands[1][i]);
            if let Some(c) = self.of_class.get_mut(tc) {
                c.true_band += u64::from(tb);
                c.both_bands += u64::from(tb && pb && tc == pc);
                if outlines[0][i] {
                    c.true_outline += 1;
                    c.true_met += u64::from(meets(i, t[i], &p, &outlines[1], width));
                }
            }
            if let Some(c) = self.of_class.get_mut(pc) {
                c.predicted_band += u64::from(pb);
                if outlines[1][i] {
                    c.predicted_outline += 1;
                    c.predicted_met += u64::from(meets(i, p[i], &t, &outlines[0], width));
                }
            }
        }
        Ok(())
    }

    /// Returns the figures so far, `None` when nothing had an outline.
    pub fn report(&self) -> Option<BoundaryReport> {
        let percent = |part: f64, whole: f64| (whole > 0.0).then(|| 100.0 * part / whole);
        let iou = |c: &Counts| {
            percent(c.both_bands as f64, (c.true_band + c.predicted_band - c.both_bands) as f64)
        };
        // F = 2PR / (P + R), and 0 where one image has no outline of the class or none is met.
        let f_score = |c: &Counts| {
            let share = |met: u64, all: u64| if all > 0 { met as f64 / all as f64 } else { 0.0 };
            let p = share(c.predicted_met, c.predicted_outline);
            let r = share(c.true_met, c.true_outline);
            let any = c.true_outline + c.predicted_outline > 0;
            any.then(|| if p + r > 0.0 { 200.0 * p * r / (p + r) } else { 0.0 })
        };
        let iou: Vec<_> = self.of_class.iter().map(iou).collect();
        let f_score: Vec<_> = self.of_class.iter().map(f_score).collect();
        let mean = |values: &[Option<f64>]| {
            let n = values.iter().flatten().count();
            (n > 0).then(|| values.iter().flatten().sum::<f64>() / n as f64)
        };
        Some(BoundaryReport {
            protocol_id: crate::protocol::BOUNDARY.into(),
            protocol: format!(
                "boundary IoU: a class's pixels within {BOUNDARY_PIXELS} pixels (a square) of \
                 another class, of truth and prediction (Cheng et al. 2021, image edge no outline); \
                 F-score: outline pixels met within {BOUNDARY_PIXELS} pixels (a disc); counts over \
                 all images, mean over the classes with an outline"
            ),
            iou_percent: mean(&iou)?,
            f_score_percent: mean(&f_score)?,
            classes: iou.iter().flatten().count(),
            iou_percent_of_class: iou,
            f_score_percent_of_class: f_score,
        })
    }
}

/// For each pixel, whether another class lies in its square of [`BOUNDARY_PIXELS`] around it
/// (`band`), or else among its four neighbours.
fn near_other(image: &[u8], width: usize, band: bool) -> Vec<bool> {
    let (low, high) = if band {
        // The least and the greatest class of the square differ from the pixel's own, or do not.
        let radius = BOUNDARY_PIXELS;
        let low = window(image, width, radius, |a, b| a.min(b));
        let shown = image.iter().map(|&c| if c == IGNORED { 0 } else { c }).collect::<Vec<_>>();
        (low, window(&shown, width, radius, |a, b| a.max(b)))
    } else {
        let mut low = image.to_vec();
        let mut high: Vec<u8> = image.iter().map(|&c| if c == IGNORED { 0 } else { c }).collect();
        for i in 0..image.len() {
            let x = i % width;
            let neighbours = [
                (x > 0).then(|| i - 1),
                (x + 1 < width).then_some(i + 1),
                i.checked_sub(width),
                (i + width < image.len()).then_some(i + width),
            ];
            for c in neighbours.into_iter().flatten().map(|j| image[j]).filter(|c| *c != IGNORED) {
                low[i] = low[i].min(c);
                high[i] = high[i].max(c);
            }
        }
        (low, high)
    };
    image
        .iter()
        .zip(low.iter().zip(&high))
        .map(|(&c, (&low, &high))| c != IGNORED && (low != c || high != c))
        .collect()
}

/// `f` over the square of `radius` around each pixel, as far as it lies in the image: first along
/// rows, then along columns.
fn window(image: &[u8], width: usize, radius: usize, f: impl Fn(u8, u8) -> u8) -> Vec<u8> {
    let mut rows = image.to_vec();
    for (out, row) in rows.chunks_exact_mut(width).zip(image.chunks_exact(width)) {
        for shift in 1..=radius.min(width - 1) {
            for x in shift..width {
                out[x] = f(out[x], row[x - shift]);
                out[x - shift] = f(out[x - shift], row[x]);
            }
        }
    }
    let mut out = rows.clone();
    for shift in 1..=radius {
        let offset = shift * width;
        for i in offset..image.len() {
            out[i] = f(out[i], rows[i - offset]);
            out[i - offset] = f(out[i - offset], rows[i]);
        }
    }
    out
}

/// Returns whether `other` has an outline pixel of `class` in the disc around pixel `i`.
fn meets(i: usize, class: u8, other: &[u8], outline: &[bool], width: usize) -> bool {
    let r = BOUNDARY_PIXELS as i64;
    let (x, y) = ((i % width) as i64, (i / width) as i64);
    let (w, h) = (width as i64, (other.len() / width) as i64);
    for dy in -r..=r {
        for dx in -r..=r {
            let (u, v) = (x + dx, y + dy);
            if dx * dx + dy * dy > r * r || u < 0 || v < 0 || u >= w || v >= h {
                continue;
            }
            let j = (v * w + u) as usize;
            if outline[j] && other[j] == class {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Left half class 0, right half class 1, the outline before column `edge`.
    fn halves(width: usize, height: usize, edge: usize) -> Vec<u8> {
        (0..width * height).map(|i| u8::from(i % width >= edge)).collect()
    }

    fn figures(width: usize, truth: &[u8], predicted: &[u8]) -> BoundaryReport {
        let mut m = BoundaryMeter::new(3);
        m.add(width, truth, predicted).unwrap();
        m.report().unwrap()
    }

    #[test]
    fn shifted_outline_by_hand() {
        let truth = halves(20, 10, 10);
        let same = figures(20, &truth, &truth);
        assert_eq!((same.iou_percent, same.f_score_percent, same.classes), (100.0, 100.0, 2));
        // Shifted by 1: class 0's bands are columns 8-9 and 9-10: one of three columns is common.
        let by_1 = figures(20, &truth, &halves(20, 10, 11));
        assert!((by_1.iou_percent - 100.0 / 3.0).abs() < 1e-9, "{by_1:?}");
        assert_eq!(by_1.f_score_percent, 100.0);
        // By 2: no common column, still within the tolerance; by 3: neither.
        let by_2 = figures(20, &truth, &halves(20, 10, 12));
        assert_eq!((by_2.iou_percent, by_2.f_score_percent), (0.0, 100.0));
        let by_3 = figures(20, &truth, &halves(20, 10, 13));
        assert_eq!((by_3.iou_percent, by_3.f_score_percent), (0.0, 0.0));
        assert_eq!(by_3.iou_percent_of_class, [Some(0.0), Some(0.0), None]);
    }

    #[test]
    fn the_band_is_what_a_slow_search_finds() {
        let (w, h) = (31, 17);
        let noise = |i: usize| (i.wrapping_mul(2_654_435_761) >> 7) % 97;
        let image: Vec<u8> = (0..w * h)
            .map(|i| match noise(i) {
                0..3 => 2,
                3..6 => IGNORED,
                _ => u8::from(i % w > 15),
            })
            .collect();
        let fast = near_other(&image, w, true);
        for i in 0..w * h {
            let (x, y) = (i % w, i / w);
            let mut near = false;
            for v in y.saturating_sub(2)..(y + 3).min(h) {
                for u in x.saturating_sub(2)..(x + 3).min(w) {
                    let c = image[v * w + u];
                    near |= c != IGNORED && c != image[i];
                }
            }
            assert_eq!(fast[i], near && image[i] != IGNORED, "{x} {y}");
        }
        assert!(fast.iter().any(|b| *b) && fast.iter().any(|b| !*b));
    }

    #[test]
    fn unlabelled_truth_makes_no_outline_and_a_hole_in_the_prediction_does() {
        let flat = vec![0u8; 200];
        let mut m = BoundaryMeter::new(1);
        m.add(20, &flat, &flat).unwrap();
        assert_eq!(m.report(), None);
        let mut void = flat.clone();
        void[..60].fill(UNLABELLED);
        // Whatever is predicted there does not count.
        m.add(20, &void, &void).unwrap();
        assert_eq!(m.report(), None);
        m.add(20, &flat, &void).unwrap();
        let r = m.report().unwrap();
        assert_eq!((r.iou_percent, r.f_score_percent), (0.0, 0.0));
        assert!(m.add(20, &flat, &flat[1..]).is_err() && m.add(7, &flat, &flat).is_err());
    }
}
