//! From scores on the network's grid to classes of the image's pixels.
use mte_slam_types::classes::UNLABELLED;

/// A class and how likely it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClassProbability {
    /// Compact index, or [`UNLABELLED`] where there are fewer classes, and for "none of them".
    pub class: u8,
    /// Probability in 1/255.
    pub probability: u8,
}

/// The likeliest classes of each pixel, descending.
pub const LIKELIEST: usize = 3;

/// Scores of all classes at every cell of a grid, the classes of a cell side by side.
pub(crate) struct Scores {
    pub columns: usize,
    pub rows: usize,
    pub classes: usize,
    pub values: Vec<f32>,
    /// Whether they are probabilities already.
    pub probabilities: bool,
}

/// What becomes of a class of the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// It counts for this compact index; several may, as those of a group.
    Class(u8),
    /// Its pixels stay unlabelled.
    None,
    /// It is left out.
    Skip,
}

/// Classes of the pixels of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Classified {
    pub labels: Vec<u8>,
    pub confidence: Vec<u8>,
    pub likeliest: Vec<[ClassProbability; LIKELIEST]>,
}

impl Scores {
    /// Whether the numbers at some cells are probabilities: none negative, and 1 in sum. Logits
    /// that are so everywhere do not occur.
    pub fn look_like_probabilities(&self) -> bool {
        let cells = self.values.chunks_exact(self.classes.max(1));
        let step = (cells.len() / 64).max(1);
        cells.step_by(step).all(|cell| {
            cell.iter().all(|p| (-1e-4..=1.0 + 1e-4).contains(p))
                && (cell.iter().sum::<f32>() - 1.0).abs() < 1e-2
        })
    }

    /// Classes of an image of `size` (width, height) pixels: scores between cell centres are linear, as
    /// PyTorch's `interpolate` without aligned corners has them; then come the probabilities.
    /// Pixels whose best class is less likely than `least` stay unlabelled. `targets`: one per class.
    pub fn classify(&self, size: [usize; 2], targets: &[Target], least: f32) -> Classified {
        let [w, h] = size;
        let n = targets
            .iter()
            .filter_map(|t| if let Target::Class(c) = t { Some(usize::from(*c) + 1) } else { None })
            .max()
            .unwrap_or(0);
        let count = self.classes.min(targets.len());
        let mut out = Classified {
            labels: Vec::with_capacity(w * h),
            confidence: Vec::with_capacity(w * h),
            likeliest: Vec::with_capacity(w * h),
        };
        let columns: Vec<_> = (0..w).map(|x| between(x, w, self.columns)).collect();
        let stride = self.columns * self.classes;
        let mut row = vec![0.0f32; stride];
        let mut scores = vec![0.0f32; count];
        // The last one is "none of them".
        let mut sums = vec![0.0f32; n + 1];
        for y in 0..h {
            let (top, bottom, v) = between(y, h, self.rows);
            let line = |r: usize| &self.values[r * stride..][..stride];
            for ((x, a), b) in row.iter_mut().zip(line(top)).zip(line(bottom)) {
                *x = a + (b - a) * v;
            }
            for &(left, right, u) in &columns {
                let cell = |c: usize| &row[c * self.classes..][..count];
                for ((s, a), b) in scores.iter_mut().zip(cell(left)).zip(cell(right)) {
                    *s = a + (b - a) * u;
                }
                self.to_probabilities(&mut scores, targets);
                sums.fill(0.0);
                for (p, target) in scores.iter().zip(targets) {
                    match target {
                        Target::Class(c) => sums[usize::from(*c)] += p,
                        Target::None => sums[n] += p,
                        Target::Skip => {}
                    }
                }
                out.push(best(&sums), least);
            }
        }
        out
    }

    fn to_probabilities(&self, scores: &mut [f32], targets: &[Target]) {
        let used = |t: &Target| *t != Target::Skip;
        if self.probabilities {
            for (s, t) in scores.iter_mut().zip(targets) {
                *s = if used(t) && s.is_finite() { s.max(0.0) } else { 0.0 };
            }
        } else {
            let finite = |x: f32| if x.is_nan() { f32::MIN } else { x.clamp(-1e30, 1e30) };
            let kept = scores.iter().zip(targets).filter(|(_, t)| used(t));
            let most = kept.map(|(s, _)| finite(*s)).fold(f32::MIN, f32::max);
            for (s, t) in scores.iter_mut().zip(targets) {
                *s = if used(t) { (finite(*s) - most).exp() } else { 0.0 };
            }
        }
        let sum: f32 = scores.iter().sum();
        if sum > 0.0 {
            scores.iter_mut().for_each(|s| *s /= sum);
        }
    }
}

impl Classified {
    fn push(&mut self, best: [(usize, f32); LIKELIEST], least: f32) {
        let none = usize::from(UNLABELLED);
        let likeliest = best.map(|(class, p)| ClassProbability {
            class: class.min(none) as u8,
            probability: (p.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
        });
        let kept = best[0].0 < none && best[0].1 >= least;
        self.labels.push(if kept { likeliest[0].class } else { UNLABELLED });
        self.confidence.push(likeliest[0].probability);
        self.likeliest.push(likeliest);
    }

    /// Classes of an image of `size` (width, height) from a map of classes of `grid` (columns, rows).
    pub fn of_map(
        map: &[i32],
        grid: [usize; 2],
        size: [usize; 2],
        targets: &[Target],
    ) -> Classified {
        let [w, h] = size;
        let mut out =
            Classified { labels: Vec::new(), confidence: Vec::new(), likeliest: Vec::new() };
        let none = (usize::from(UNLABELLED), 0.0);
        for y in 0..h {
            for x in 0..w {
                // The cell in which the pixel's centre lies.
                let cell = |i: usize, n: usize, cells: usize| (2 * i + 1) * cells / (2 * n);
                let class = map[cell(y, h, grid[1]) * grid[0] + cell(x, w, grid[0])];
                let target = usize::try_from(class).ok().and_then(|c| targets.get(c));
                let best = match target {
                    Some(Target::Class(c)) => (usize::from(*c), 1.0),
                    _ => none,
                };
                out.push([best, none, none], 0.0);
            }
        }
        out
    }
}

/// The likeliest of `sums`, whose last entry is "none of them"; equal ones in order of their index.
fn best(sums: &[f32]) -> [(usize, f32); LIKELIEST] {
    let none = usize::from(UNLABELLED);
    let mut best = [(none, -1.0f32); LIKELIEST];
    for (i, &p) in sums.iter().enumerate() {
        let class = if i + 1 == sums.len() { none } else { i };
        let mut entry = (class, p);
        for slot in &mut best {
            if entry.1 > slot.1 {
                core::mem::swap(slot, &mut entry);
            }
        }
    }
    best.map(|(class, p)| (class, p.max(0.0)))
}

/// Neighbouring cells of pixel `i` of `n`, and the share of the second.
fn between(i: usize, n: usize, cells: usize) -> (usize, usize, f32) {
    let x = ((i as f32 + 0.5) * (cells as f32 / n as f32) - 0.5).max(0.0);
    let low = (x as usize).min(cells - 1);
    (low, (low + 1).min(cells - 1), (x - low as f32).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Target; 3] = [Target::Class(0), Target::Class(1), Target::Class(2)];

    fn scores(columns: usize, rows: usize, values: &[f32]) -> Scores {
        let classes = values.len() / columns / rows;
        Scores { columns, rows, classes, values: values.to_vec(), probabilities: false }
    }

    #[test]
    fn the_largest_score_wins_and_probabilities_sum_up() {
        let s = scores(2, 2, &[3.0, 1.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 5.0, 9.0, 8.0, 7.0]);
        let c = s.classify([2, 2], &ALL, 0.0);
        assert_eq!(c.labels, [0, 1, 2, 0]);
        let e = |x: f32| x.exp();
        let p = e(3.0) / (e(3.0) + e(1.0) + 1.0);
        assert!((f32::from(c.confidence[0]) / 255.0 - p).abs() < 0.003);
        assert_eq!(c.likeliest[3].map(|l| l.class), [0, 1, 2]);
        // Less certain than asked for.
        assert_eq!(s.classify([2, 2], &ALL, 0.9).labels, [UNLABELLED, 1, 2, UNLABELLED]);
        assert!(!s.look_like_probabilities());
        let p = Scores { probabilities: true, ..scores(1, 1, &[0.2, 0.5, 0.3]) };
        assert!(p.look_like_probabilities());
        assert_eq!(p.classify([1, 1], &ALL, 0.0).confidence, [128]);
    }

    #[test]
    fn classes_may_be_left_out_mean_nothing_or_belong_together() {
        let s = Scores { probabilities: true, ..scores(1, 1, &[0.4, 0.35, 0.25]) };
        let label = |targets: [Target; 3]| s.classify([1, 1], &targets, 0.0).labels[0];
        assert_eq!(label(ALL), 0);
        assert_eq!(label([Target::Skip, Target::Class(0), Target::Class(1)]), 0);
        assert_eq!(label([Target::None, Target::Class(0), Target::Class(1)]), UNLABELLED);
        // Together they are likelier.
        assert_eq!(label([Target::Class(0), Target::Class(1), Target::Class(1)]), 1);
        let skipped = s.classify([1, 1], &[Target::Skip, Target::Class(0), Target::Class(1)], 0.0);
        assert_eq!(skipped.confidence[0], (0.35f32 / 0.6 * 255.0 + 0.5) as u8);
    }

    #[test]
    fn scores_are_linear_between_cells_and_maps_are_not_mixed() {
        // From 0 to 1 over two cells, four pixels: 0, 1/4, 3/4, 1 of the way.
        let s = scores(2, 1, &[1.0, 0.0, 0.0, 1.0]);
        let c = s.classify([4, 1], &ALL[..2], 0.0);
        assert_eq!(c.labels, [0, 0, 1, 1]);
        let q = (0.75f32 - 0.25).exp() / ((0.75f32 - 0.25).exp() + 1.0);
        assert_eq!(c.confidence[1], (q * 255.0 + 0.5) as u8);
        let map = Classified::of_map(&[0, 2, 7, -1], [2, 2], [4, 2], &ALL);
        assert_eq!(map.labels, [0, 0, 2, 2, UNLABELLED, UNLABELLED, UNLABELLED, UNLABELLED]);
        assert_eq!(map.confidence, [255, 255, 255, 255, 0, 0, 0, 0]);
    }

    #[test]
    fn what_is_no_number_wins_nothing() {
        let s = scores(1, 1, &[f32::NAN, 1.0, f32::NEG_INFINITY]);
        assert_eq!(s.classify([1, 1], &ALL, 0.0).labels, [1]);
        let s = scores(1, 1, &[f32::NAN; 3]);
        assert_eq!(s.classify([1, 1], &ALL, 0.5).labels, [UNLABELLED]);
    }
}
