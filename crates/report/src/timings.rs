//! `timings.csv`: what each frame cost.
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// One frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Timing {
    /// Frame index.
    pub frame: usize,
    /// Seconds of tracking.
    pub tracking_s: f64,
    /// Seconds of mapping (0 for a frame that was not mapped).
    pub mapping_s: f64,
    /// Seconds of the whole frame, without decoding its images.
    pub total_s: f64,
    /// `first`, `tracked` or `lost`.
    #[serde(skip)]
    pub status: &'static str,
}

/// The file's text.
pub fn write_csv(timings: &[Timing]) -> String {
    let mut text = String::from("frame,tracking_s,mapping_s,total_s,status\n");
    for t in timings {
        let _ = writeln!(
            text,
            "{},{:.6},{:.6},{:.6},{}",
            t.frame, t.tracking_s, t.mapping_s, t.total_s, t.status
        );
    }
    text
}

/// Median, 95th percentile and mean of a list of seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median \[s\].
    pub median_s: f64,
    /// 95th percentile (nearest rank) \[s\].
    pub p95_s: f64,
    /// Mean \[s\].
    pub mean_s: f64,
}

impl Spread {
    /// Of no values: zeros.
    pub fn of(values: impl Iterator<Item = f64>) -> Spread {
        let mut v: Vec<f64> = values.collect();
        if v.is_empty() {
            return Spread::default();
        }
        v.sort_by(f64::total_cmp);
        let n = v.len();
        let median_s = if n % 2 == 1 { v[n / 2] } else { 0.5 * (v[n / 2 - 1] + v[n / 2]) };
        let rank = (0.95 * n as f64).ceil() as usize;
        Spread {
            median_s,
            p95_s: v[rank.clamp(1, n) - 1],
            mean_s: v.iter().sum::<f64>() / n as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_of_known_lists() {
        let s = Spread::of((1..=100).rev().map(f64::from));
        assert_eq!((s.median_s, s.p95_s, s.mean_s), (50.5, 95.0, 50.5));
        assert_eq!(Spread::of([3.0].into_iter()).p95_s, 3.0);
        assert_eq!(Spread::of([].into_iter()), Spread::default());
    }
}
