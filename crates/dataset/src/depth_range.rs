//! How far depth reaches: counts of its values, and which ranges no room has.

/// Units of depth per metre that are in use: millimetres, TUM, Replica, 0.1 mm, RealSense L515,
/// KITTI.
pub(super) const USUAL_UNITS: [f64; 6] = [1000.0, 5000.0, 6553.5, 10_000.0, 4000.0, 256.0];
/// Half of the depth lies between these in rooms \[m\].
const USUAL_MEDIAN_M: core::ops::RangeInclusive<f64> = 0.4..=15.0;
/// Below this it is usual only if it were none as millimetres, the most frequent mistake \[m\].
const NEAR_MEDIAN_M: f64 = 0.5;
/// How [`unusual`] begins.
pub(super) const UNUSUAL_START: &str = "half of the depth is below";
/// Depth this many times the range of its middle half beyond that half lies apart from the rest.
const FENCE: f64 = 3.0;
/// It does if no more than this share of it lies within the next half of that distance.
const BETWEEN_SHARE: f64 = 0.25;
/// Farther than indoor sensors measure \[m\].
const SENSOR_RANGE_M: f64 = 12.0;
/// Share of the depth that can be noise: less is not worth a word, more is part of the scene.
const FAR_SHARE: core::ops::RangeInclusive<f64> = 0.001..=0.1;

/// How often each value of depth occurs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Histogram(Vec<u64>);

impl Default for Histogram {
    fn default() -> Self {
        Histogram(vec![0; 1 << 16])
    }
}

impl Histogram {
    /// Of values and how often they occur.
    pub fn of(holes: u64, values: impl Iterator<Item = (u16, u64)>) -> Histogram {
        let mut all = Histogram::default();
        all.0[0] = holes;
        values.for_each(|(value, n)| all.0[usize::from(value)] += n);
        all
    }

    pub fn add(&mut self, depth: &[u16]) {
        depth.iter().for_each(|d| self.0[usize::from(*d)] += 1);
    }

    pub fn join(&mut self, other: &Histogram) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += b);
    }

    /// Returns the number of pixels, with those without a measurement.
    pub fn pixels(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Returns how often a value occurs.
    pub fn count(&self, value: u16) -> u64 {
        self.0[usize::from(value)]
    }

    /// Returns the number of measured pixels.
    pub fn measured(&self) -> u64 {
        self.pixels() - self.0[0]
    }

    /// Returns the values that occur and are measurements, rising, and how often they do.
    pub fn values(&self) -> impl DoubleEndedIterator<Item = (u16, u64)> {
        let counts = self.0.iter().enumerate().skip(1);
        counts.filter(|(_, n)| **n > 0).map(|(value, n)| (value as u16, *n))
    }

    /// Returns the value that a share of the measured pixels does not exceed; 0 without any.
    pub fn quantile(&self, share: f64) -> u16 {
        let wanted = (share * self.measured() as f64).max(1.0);
        let mut seen = 0;
        let reached = |(_, n): &(u16, u64)| {
            seen += n;
            seen as f64 >= wanted
        };
        self.values().find(reached).map_or(0, |(value, _)| value)
    }

    /// Takes out what is beyond a range, or a value that means that nothing was measured.
    pub fn without(&self, hole: impl Fn(u16) -> bool) -> Histogram {
        let mut out = self.clone();
        for (value, n) in self.values().filter(|(value, _)| hole(*value)) {
            out.0[usize::from(value)] = 0;
            out.0[0] += n;
        }
        out
    }

    /// Finds depth that lies far from the rest, or farther than sensors measure and other depth
    /// does, where it is a small part.
    pub fn far(&self, unit_m: f64) -> Option<FarDepth> {
        let metres = |share: f64| f64::from(self.quantile(share)) * unit_m;
        let beyond = |limit_m: f64| {
            let far = self.values().filter(|(value, _)| f64::from(*value) * unit_m > limit_m);
            far.map(|(_, n)| n).sum::<u64>() as f64 / self.measured().max(1) as f64
        };
        let (low, high) = (metres(0.25), metres(0.75));
        // Rounded up to half metres, which people can remember.
        let fence_m = (2.0 * (high + FENCE * (high - low))).ceil() / 2.0;
        let share = beyond(fence_m);
        let between = share - beyond(1.5 * fence_m);
        if FAR_SHARE.contains(&share) && between <= BETWEEN_SHARE * share {
            return Some(FarDepth { limit_m: fence_m, share });
        }
        let (limit_m, share) = (SENSOR_RANGE_M, beyond(SENSOR_RANGE_M));
        let noise = limit_m > fence_m && metres(1.0) > 2.0 * limit_m;
        (FAR_SHARE.contains(&share) && noise).then_some(FarDepth { limit_m, share })
    }
}

/// Depth that lies far beyond the rest.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FarDepth {
    /// A limit that the rest does not reach \[m\].
    pub limit_m: f64,
    /// Share of the measured pixels that is farther.
    pub share: f64,
}

/// Returns whether half of the depth is nearer or farther than rooms are, in words, with the units
/// that would do. `median_m` is in the recording's unit.
pub(super) fn unusual(median_m: f64, depth_unit_m: f64) -> Option<String> {
    let units = 1.0 / depth_unit_m;
    let as_millimetres = median_m * units / 1000.0;
    let near = median_m < NEAR_MEDIAN_M && (1.0..=6.0).contains(&as_millimetres);
    if median_m <= 0.0 || (USUAL_MEDIAN_M.contains(&median_m) && !near) {
        return None;
    }
    let fits: Vec<String> = USUAL_UNITS
        .into_iter()
        .filter(|u| (0.5..=6.0).contains(&(median_m * units / u)))
        .map(|u| format!("{:.2} m with --depth-scale {u}", median_m * units / u))
        .collect();
    let hint = if fits.is_empty() { "".into() } else { format!(": {}", fits.join(", ")) };
    let what = match median_m {
        0.15..=1.0 => "which is nearer than rooms are",
        _ => "which no room has",
    };
    Some(format!("{UNUSUAL_START} {median_m:.3} m at {units} units per metre, {what}{hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: impl IntoIterator<Item = u16>) -> Histogram {
        let mut all = Histogram::default();
        all.add(&values.into_iter().collect::<Vec<_>>());
        all
    }

    #[test]
    fn counts_and_quantiles() {
        let h = of([0, 0, 5, 5, 7, 9]);
        assert_eq!((h.pixels(), h.measured(), h.count(5)), (6, 4, 2));
        assert_eq!([0.0, 0.5, 0.51, 1.0].map(|q| h.quantile(q)), [5, 5, 7, 9]);
        assert_eq!(h.without(|v| v > 6).values().collect::<Vec<_>>(), [(5, 2)]);
        assert_eq!((h.without(|v| v > 6).count(0), Histogram::default().quantile(0.5)), (4, 0));
    }

    #[test]
    fn depth_far_from_the_rest_is_found_and_a_long_room_is_not() {
        // 1 to 3 m, and some of it at 10 to 50 m.
        let near = (0..2000u16).map(|i| 1000 + i);
        let far = |n: u16| (0..n).map(move |i| 10_000 + i * (40_000 / n));
        let found = of(near.clone().chain(far(100))).far(1e-3).unwrap();
        assert!((4.0..8.0).contains(&found.limit_m), "{found:?}");
        assert!((found.share - 100.0 / 2100.0).abs() < 1e-3, "{found:?}");
        assert_eq!(of(near.clone()).far(1e-3), None);
        assert_eq!(of(near.clone().chain(far(1))).far(1e-3), None, "too little");
        assert_eq!(of(near.clone().chain(far(800))).far(1e-3), None, "part of the scene");
        // A corridor: less and less, but without a gap.
        let corridor = (1..4000u32).map(|i| (1_200_000 / (i + 80)) as u16);
        assert_eq!(of(corridor).far(1e-3), None);
        assert_eq!(Histogram::default().far(1e-3), None);
        // The noise of a sensor, which thins out like a corridor, but reaches farther than any.
        let noise = (1..4000u32).map(|i| (1_200_000 / (i + 17)) as u16);
        let found = of(noise).far(1e-3).unwrap();
        assert!(found.limit_m == 12.0 && (0.01..0.03).contains(&found.share), "{found:?}");
    }

    #[test]
    fn both_ends_of_the_range_are_unusual() {
        assert_eq!(
            (unusual(0.0, 1e-3), unusual(0.4, 1e-3), unusual(15.0, 1e-3)),
            (None, None, None)
        );
        let near = unusual(0.32, 1.0 / 5000.0).unwrap();
        assert!(near.contains("nearer than rooms are: 1.60 m with --depth-scale 1000"), "{near}");
        assert!(unusual(0.45, 1.0 / 5000.0).is_some() && unusual(0.45, 1e-3).is_none());
        assert!(unusual(0.03, 1e-3).unwrap().contains("no room has"));
        assert!(unusual(20.0, 1e-3).unwrap().contains("4.00 m with --depth-scale 5000"));
    }
}
