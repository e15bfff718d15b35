//! Time stamps: which belong together, and what they mean where they do not.
use crate::folder::{base, plural};

/// Largest difference between stamps that belong together \[s\].
pub(super) const WINDOW_S: f64 = 0.02;

/// For each of `a` the index of its partner in `b` (both ascending): closest pairs first, each
/// used once, none further apart than the window.
pub(super) fn associate(a: &[f64], b: &[f64]) -> Vec<Option<usize>> {
    // Enough for any real rate, and a bound on the work for lists full of equal stamps.
    const NEIGHBOURS: usize = 16;
    let mut pairs = Vec::new();
    for (i, &t) in a.iter().enumerate() {
        let at = b.partition_point(|&s| s < t);
        for j in at.saturating_sub(NEIGHBOURS)..(at + NEIGHBOURS).min(b.len()) {
            let gap = (b[j] - t).abs();
            // Stamps are large: allow for the last bits of their difference.
            if gap <= WINDOW_S + 1e-6 {
                pairs.push((gap, i, j));
            }
        }
    }
    pairs.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)).then(p.2.cmp(&q.2)));
    let mut partner = vec![None; a.len()];
    let mut taken = vec![false; b.len()];
    for (_, i, j) in pairs {
        if partner[i].is_none() && !taken[j] {
            partner[i] = Some(j);
            taken[j] = true;
        }
    }
    partner
}

/// Says what is wrong with the stamps of a list, in the order of its lines.
pub(super) fn disorder(list: &str, stamps: &[f64]) -> Option<String> {
    let count = |wrong: fn(&[f64]) -> bool| stamps.windows(2).filter(|w| wrong(w)).count();
    let (falls, repeats) = (count(|w| w[1] < w[0]), count(|w| w[1] == w[0]));
    if falls + repeats == 0 {
        return None;
    }
    let low = stamps.iter().copied().fold(f64::INFINITY, f64::min);
    let high = stamps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Times of a camera rise but for a line here and there.
    let looks = if (falls + repeats) * 5 > stamps.len() {
        "; they look like durations or something else that is no time, and then the frames are \
         shuffled"
    } else {
        ""
    };
    Some(format!(
        "{list}: of {} ({low} to {high} s) {falls} are smaller than the one before and {repeats} \
         equal to it: sorted by them{looks}; --order file takes the frames as the lines are",
        plural(stamps.len(), "time stamp")
    ))
}

/// Says how stamps of which none fits would fit, if all were in another unit or began elsewhere.
/// Both ascend.
pub(super) fn explanation(stamps: &[f64], truth: &[f64]) -> Option<String> {
    let (Some(&first), Some(&truth_first)) = (stamps.first(), truth.first()) else { return None };
    let fits = |change: &dyn Fn(f64) -> f64| {
        let changed: Vec<f64> = truth.iter().map(|&t| change(t)).collect();
        let met = associate(stamps, &changed).iter().flatten().count();
        met > 0 && 2 * met >= stamps.len().min(truth.len())
    };
    const UNITS: [(f64, &str); 6] = [
        (1e-3, "in milliseconds"),
        (1e-6, "in microseconds"),
        (1e-9, "in nanoseconds"),
        (1e3, "if the images' stamps were in milliseconds"),
        (1e6, "if the images' stamps were in microseconds"),
        (1e9, "if the images' stamps were in nanoseconds"),
    ];
    if let Some((_, words)) = UNITS.iter().find(|(factor, _)| fits(&|t| t * factor)) {
        return Some((*words).into());
    }
    let begin = "if both began at the same time";
    if fits(&|t| t - truth_first + first) {
        return Some(begin.into());
    }
    let late = |factor: f64| move |t: f64| (t - truth_first) * factor + first;
    let (_, words) = UNITS.iter().take(3).find(|(factor, _)| fits(&late(*factor)))?;
    Some(format!("{words} and {begin}"))
}

/// Returns the time stamp that a file is named by, as `1305031453.359684.png` is \[s\].
pub(super) fn in_name(file: &str) -> Option<f64> {
    let (stem, _) = base(file).rsplit_once('.')?;
    let digits = stem.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    (digits && stem.contains('.')).then(|| stem.parse().ok()).flatten()
}

/// Returns whether each stamp is later than the one before.
pub(super) fn rise(stamps: &[f64]) -> bool {
    stamps.windows(2).all(|w| w[0] < w[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_stamps_pair_up_once() {
        let a = [1.0, 1.03, 1.06, 2.0, 3.0];
        let b = [0.985, 1.022, 1.035, 2.03, 3.02];
        assert_eq!(associate(&a, &b), [Some(0), Some(2), None, None, Some(4)]);
        // Both want the same one; the closer wins and the other takes what is left.
        assert_eq!(associate(&[1.0, 1.01], &[1.009, 1.02]), [Some(1), Some(0)]);
        assert_eq!(associate(&[1.0], &[]), [None]);
    }

    #[test]
    fn stamps_that_are_no_times_are_said() {
        assert_eq!(disorder("rgb.txt", &[1.0, 2.0, 3.0]), None);
        let one = [1.0, 2.0, 1.5, 3.0, 4.0, 5.0, 6.0, 7.0];
        let said = disorder("rgb.txt", &one).unwrap();
        assert!(said.contains("8 time stamps (1 to 7 s) 1 are smaller"), "{said}");
        assert!(said.contains("--order file") && !said.contains("durations"), "{said}");
        let said = disorder("rgb.txt", &[0.02, 0.01, 0.01, 0.03, 0.02]).unwrap();
        assert!(said.contains("2 are smaller than the one before and 1 equal"), "{said}");
        assert!(said.contains("durations"), "{said}");
    }

    #[test]
    fn another_unit_or_another_beginning_is_found() {
        let images: Vec<f64> = (0..20).map(|i| 1.3e9 + f64::from(i) * 0.25).collect();
        let with = |change: &dyn Fn(f64) -> f64| {
            let truth: Vec<f64> = images.iter().map(|t| change(*t)).collect();
            explanation(&images, &truth)
        };
        assert_eq!(with(&|t| t * 1e3).unwrap(), "in milliseconds");
        assert_eq!(with(&|t| t * 1e9).unwrap(), "in nanoseconds");
        assert!(with(&|t| t * 1e-6).unwrap().contains("images' stamps were in microseconds"));
        assert_eq!(with(&|t| t - 1.3e9).unwrap(), "if both began at the same time");
        let both = with(&|t| (t - 1.3e9) * 1e3).unwrap();
        assert_eq!(both, "in milliseconds and if both began at the same time");
        assert_eq!(with(&|t| (t - 1.3e9) * 7.7), None);
        assert_eq!(explanation(&images, &[]), None);
    }

    #[test]
    fn names_that_are_time_stamps() {
        assert_eq!(in_name("rgb/1305031453.359684.png"), Some(1305031453.359684));
        for none in ["rgb/17.png", "rgb/a1.5.png", "rgb/1.2.3.png", "1"] {
            assert_eq!(in_name(none), None, "{none}");
        }
        assert!(rise(&[1.0, 2.0]) && !rise(&[1.0, 1.0]) && !rise(&[1.0, f64::NAN]));
    }
}
