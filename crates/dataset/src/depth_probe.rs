//! What the values of depth mean, judged at opening by some of the images: codes for "nothing
//! measured", bits that are rotated, and ranges that no room has.
use super::{
    decode::Size,
    depth_range::{Histogram, unusual},
    entries::Entry,
    folder::Folder,
};

/// Images that are looked at.
const IMAGES: usize = 3;
/// What sensors and programs give where they are saturated. It is the largest number of a pixel, so
/// that nothing that is farther can be told from it either.
pub(super) const SATURATED: u16 = u16::MAX;
/// A code fills at least this share of each image's measured pixels.
const CODE_SHARE: f64 = 0.02;
/// And leaves at least this share.
const REST_SHARE: f64 = 0.1;
/// The next smaller value is less than this part of a code that is no usual one.
const CODE_GAP: f64 = 0.75;
/// SUN3D and the APC data rotate the bits of depth by this many.
const ROTATION: u32 = 3;
/// Share of the pixels that must look so.
const ROTATED_SHARE: f64 = 0.99;
/// Different values that it takes to say so.
const ROTATED_VALUES: usize = 64;

/// How the numbers in depth images are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct DepthCode {
    /// A value besides 0 and 65535 that means "no measurement".
    pub hole: Option<u16>,
    /// Whether the bits are rotated.
    pub rotated: bool,
    /// Farther is a hole; 0 where there is no limit \[units\].
    pub limit: u16,
}

impl DepthCode {
    /// Turns the stored numbers into depth, 0 where there is none.
    pub fn apply(&self, depth: &mut [u16]) {
        for d in depth {
            if self.rotated {
                *d = d.rotate_right(ROTATION);
            }
            if self.is_hole(*d) {
                *d = 0;
            }
        }
    }

    fn is_hole(&self, d: u16) -> bool {
        d == SATURATED || Some(d) == self.hole || (self.limit > 0 && d > self.limit)
    }
}

/// What is known of a recording's depth before any image is looked at.
pub(super) struct Known {
    pub unit_m: f64,
    /// Whether people gave the unit, so that nothing is to be guessed.
    pub unit_given: bool,
    /// A value that the layout says means "no measurement".
    pub hole: Option<u16>,
    /// The range that is wanted \[m\].
    pub max_m: Option<f64>,
}

/// Looks at some of the images. Those that cannot be read say so when their turn comes.
pub(super) fn probe(
    folder: &Folder,
    frames: &[Entry],
    size: Size,
    known: &Known,
    warnings: &mut Vec<String>,
) -> DepthCode {
    // A packed file is read onwards, and far ahead is far to go.
    let packed = frames.iter().any(|f| f.depth.part.is_some());
    let n = IMAGES.min(frames.len());
    let index = |i: usize| if packed { i } else { i * (frames.len() - 1) / (n - 1).max(1) };
    let images = (0..n).filter_map(|i| {
        let frame = &frames[index(i)];
        let mut counts = Histogram::default();
        counts.add(&frame.depth.depth(folder, frame.number, size).ok()?);
        Some(counts)
    });
    judge(images.collect(), known, warnings)
}

fn judge(mut images: Vec<Histogram>, known: &Known, warnings: &mut Vec<String>) -> DepthCode {
    let mut code = DepthCode { hole: known.hole, ..DepthCode::default() };
    let metres = |d: u16| f64::from(d) * known.unit_m;
    let median = |images: &[Histogram], code: DepthCode| {
        let mut all = Histogram::default();
        images.iter().for_each(|h| all.join(h));
        all.without(|d| code.is_hole(d)).quantile(0.5)
    };
    if !known.unit_given && are_rotated(&images, known.unit_m) {
        let before = metres(median(&images, code));
        for counts in &mut images {
            let turned = |(v, n): (u16, u64)| (v.rotate_right(ROTATION), n);
            *counts = Histogram::of(counts.count(0), counts.values().map(turned));
        }
        code.rotated = true;
        let after = metres(median(&images, code));
        warnings.push(format!(
            "the bits of depth are rotated by {ROTATION}, as in SUN3D and APC, and turned back: half \
             is below {after:.2} m rather than {before:.1} m (an explicit --depth-scale takes the \
             numbers as they are)"
        ));
    }
    let saturated: u64 = images.iter().map(|h| h.count(SATURATED)).sum();
    let measured: u64 = images.iter().map(Histogram::measured).sum();
    let share = |n: u64| 100.0 * n as f64 / measured.max(1) as f64;
    if saturated > 0 && known.hole != Some(SATURATED) {
        let percent = share(saturated);
        warnings.push(format!(
            "depth of {SATURATED}, the largest number ({percent:.1} % of the depth of some frames), \
             is taken as no measurement"
        ));
    }
    if let Some(hole) = repeated_maximum(&images) {
        let percent = share(images.iter().map(|h| h.count(hole)).sum());
        warnings.push(format!(
            "depth of {hole} ({:.2} m, {percent:.0} % of the depth of some frames and the largest in \
             each) is taken as no measurement",
            metres(hole)
        ));
        code.hole = Some(hole);
    }
    if let Some(max_m) = known.max_m {
        // At least 1, for 0 is no limit; nothing can be nearer.
        code.limit = (max_m / known.unit_m).clamp(1.0, 65535.0) as u16;
    }
    let median = metres(median(&images, code));
    warnings.extend(unusual(median, known.unit_m));
    code
}

/// Millimetres rotated by three bits are multiples of 8 as long as they are below 8192, and eight
/// times as far as they should be.
fn are_rotated(images: &[Histogram], unit_m: f64) -> bool {
    let mut all = Histogram::default();
    images.iter().for_each(|h| all.join(h));
    let all = all.without(|d| d == SATURATED);
    let (distinct, fits) = all.values().fold((0, 0), |(distinct, fits), (value, n)| {
        (distinct + 1, fits + if value.trailing_zeros() >= ROTATION { n } else { 0 })
    });
    let median = all.quantile(0.5);
    let as_is = f64::from(median) * unit_m;
    let turned = f64::from(median.rotate_right(ROTATION)) * unit_m;
    distinct >= ROTATED_VALUES
        && fits as f64 >= ROTATED_SHARE * all.measured() as f64
        && as_is > 3.0
        && (0.35..=8.0).contains(&turned)
}

/// Finds a value that is the largest of each image, fills a part of it, and is a power of two less
/// one or far from the rest. A wall does neither in each of several views.
fn repeated_maximum(images: &[Histogram]) -> Option<u16> {
    let images: Vec<Histogram> = images.iter().map(|h| h.without(|d| d == SATURATED)).collect();
    // A camera that stands still shows one wall all the time.
    let moved = images.windows(2).any(|w| w[0] != w[1]);
    let (hole, _) = images.first()?.values().next_back()?;
    let usual = hole >= 1023 && hole.checked_add(1).is_some_and(u16::is_power_of_two);
    let is_code = |counts: &Histogram| {
        let mut largest = counts.values().rev();
        let (value, n) = largest.next().unwrap_or((0, 0));
        let apart =
            largest.next().is_some_and(|(next, _)| f64::from(next) < CODE_GAP * f64::from(hole));
        let (n, measured) = (n as f64, counts.measured() as f64);
        value == hole
            && n >= CODE_SHARE * measured
            && n <= (1.0 - REST_SHARE) * measured
            && (usual || apart)
    };
    (images.len() > 1 && moved && images.iter().all(is_code)).then_some(hole)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MM: Known = Known { unit_m: 1e-3, unit_given: false, hole: None, max_m: None };

    /// Three views of 0.8 m to 2.8 m, each value changed.
    fn views(change: impl Fn(u16) -> u16) -> Vec<Histogram> {
        let view = |k: u16| {
            let mut counts = Histogram::default();
            let values: Vec<u16> = (0..2000u16).map(|i| change(800 + i / 2 * 2 + k * 7)).collect();
            counts.add(&values);
            counts
        };
        (0..3).map(view).collect()
    }

    fn judged(images: Vec<Histogram>, known: &Known) -> (DepthCode, String) {
        let mut warnings = Vec::new();
        let code = judge(images, known, &mut warnings);
        (code, warnings.join("\n"))
    }

    #[test]
    fn plain_depth_is_taken_as_it_is() {
        assert_eq!(judged(views(|d| d), &MM), (DepthCode::default(), String::new()));
        assert_eq!(judged(Vec::new(), &MM), (DepthCode::default(), String::new()));
        // One wall, and holes: the largest value of each view, and all there is.
        let wall = |d: u16| if d < 1000 { 0 } else { 3000 };
        assert_eq!(judged(views(wall), &MM).0, DepthCode::default());
    }

    #[test]
    fn codes_for_nothing_are_found() {
        let every_fifth = |code: u16| move |d: u16| if d.is_multiple_of(5) { code } else { d };
        for hole in [4095, 8191, 10_000, 40_000] {
            let (code, said) = judged(views(every_fifth(hole)), &MM);
            assert_eq!(code.hole, Some(hole));
            assert!(
                said.contains(&format!("depth of {hole} (")) && said.contains("20 %"),
                "{said}"
            );
            let mut depth = [0, 900, hole, SATURATED];
            code.apply(&mut depth);
            assert_eq!(depth, [0, 900, 0, 0]);
        }
        // Near the rest, and no power of two: a wall that is cut at the sensor's range, perhaps.
        assert_eq!(judged(views(every_fifth(3000)), &MM).0.hole, None);
        // The same view all the time says nothing.
        let still: Vec<Histogram> = vec![views(every_fifth(10_000))[0].clone(); 3];
        assert_eq!(judged(still, &MM).0.hole, None);
        let (code, said) = judged(views(every_fifth(SATURATED)), &MM);
        assert_eq!(code.hole, None);
        assert!(said.contains("depth of 65535") && said.contains("20.0 %"), "{said}");
        let known = Known { hole: Some(SATURATED), ..MM };
        assert_eq!(judged(views(every_fifth(SATURATED)), &known).1, "");
    }

    #[test]
    fn rotated_bits_are_found_and_turned_back() {
        let stored = |d: u16| d.rotate_left(3);
        let (code, said) = judged(views(stored), &MM);
        assert!(code.rotated && said.contains("rotated") && said.contains("1.81 m"), "{said}");
        let mut depth = [0, stored(1234), stored(9000), SATURATED];
        code.apply(&mut depth);
        assert_eq!(depth, [0, 1234, 9000, 0]);
        // A unit of 1/8 mm that is known, by a file or by people, is no rotation.
        assert!(!judged(views(stored), &Known { unit_m: 1e-3 / 8.0, ..MM }).0.rotated);
        assert!(!judged(views(stored), &Known { unit_given: true, ..MM }).0.rotated);
    }

    #[test]
    fn a_limit_and_unusual_ranges() {
        let (code, _) = judged(views(|d| d), &Known { max_m: Some(2.0), ..MM });
        let mut depth = [0, 1999, 2000, 2001];
        code.apply(&mut depth);
        assert_eq!(depth, [0, 1999, 2000, 0]);
        let (code, _) = judged(views(|d| d), &Known { max_m: Some(1e-9), ..MM });
        assert_eq!(code.limit, 1);
        let (_, said) = judged(views(|d| d), &Known { unit_m: 1.0 / 5000.0, ..MM });
        assert!(
            said.contains("half of the depth is below 0.36") && said.contains("1000"),
            "{said}"
        );
    }
}
