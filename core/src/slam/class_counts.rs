//! How often each class was seen, and how its labels count because of that.
use crate::{config::LossConfig, frame::Frame, map::ClassWeight};
use alloc::{vec, vec::Vec};

/// Classes never weigh more than this against the mean pixel.
const MAX_CLASS_WEIGHT: f64 = 10.0;

/// How often each class was seen, over all mapped frames.
#[derive(Clone, Debug, Default)]
pub(super) struct ClassCounts(pub Vec<f64>);

impl ClassCounts {
    /// Adds a frame's labels.
    pub fn add(&mut self, classes: usize, frame: &Frame) {
        self.0.resize(classes, 0.0);
        for label in frame.labels.iter().flatten() {
            if let Some(n) = self.0.get_mut(*label as usize) {
                *n += 1.0;
            }
        }
    }

    /// Whether there was any label.
    pub fn any(&self) -> bool {
        self.0.iter().any(|n| *n > 0.0)
    }

    /// Weights by inverse frequency to the power of `balance`; the mean pixel weighs 1.
    pub fn weights(&self, balance: f64) -> Vec<f32> {
        let total: f64 = self.0.iter().sum();
        let raw: Vec<f64> = self.0.iter().map(|n| libm::pow(total / n.max(1.0), balance)).collect();
        let mean = raw.iter().zip(&self.0).map(|(w, n)| w * n).sum::<f64>() / total.max(1.0);
        raw.iter().map(|w| (w / mean.max(1e-9)).min(MAX_CLASS_WEIGHT) as f32).collect()
    }

    /// The same for rays, `rare_share` of which are the rarest in class of `rare_draws`. Labels that
    /// weigh w times as much, or are drawn w times as often, make their class w times as likely to
    /// a classifier as it is: `loss.adjustment` is the share of ln w that the loss takes over (Menon
    /// et al., Long-tail learning via logit adjustment, 2021, eq. 10).
    pub fn ray_weights(
        &self,
        loss: &LossConfig,
        rare_share: f64,
        rare_draws: u32,
    ) -> Vec<ClassWeight> {
        let total = self.0.iter().sum::<f64>().max(1.0);
        let mut by_frequency: Vec<usize> = (0..self.0.len()).collect();
        by_frequency.sort_by(|a, b| self.0[*b].total_cmp(&self.0[*a]));
        let plain = self.weights(loss.balance);
        let mut weights = vec![ClassWeight::default(); self.0.len()];
        let mut commoner = 0.0;
        for class in by_frequency {
            // The rarest of the draws is of this class if none is rarer, but not all are commoner.
            let share = self.0[class].max(1.0) / total;
            let none_above = |below: f64| libm::pow(below.min(1.0), f64::from(rare_draws));
            let rarest = none_above(commoner + share) - none_above(commoner);
            commoner += share;
            let drawn = 1.0 - rare_share + rare_share * rarest / share;
            let weight = plain[class];
            let ln = libm::log((f64::from(weight) * drawn).max(1e-9));
            weights[class] = ClassWeight { weight, adjustment: (loss.adjustment * ln) as f32 };
        }
        weights
    }

    /// How rare each class is: one over its pixels.
    pub fn rarity(&self) -> Vec<f32> {
        self.0.iter().map(|n| (1.0 / n.max(1.0)) as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::shared::random_u32;

    #[test]
    fn adjustments_undo_what_weights_and_draws_add() {
        let counts = ClassCounts(vec![700.0, 0.0, 250.0, 50.0]);
        let loss =
            |balance, adjustment| LossConfig { balance, adjustment, ..LossConfig::default() };
        let even = counts.ray_weights(&loss(0.0, 1.0), 0.0, 24);
        assert!(even.iter().all(|w| w.weight == 1.0 && w.adjustment == 0.0), "{even:?}");
        let weighed = counts.ray_weights(&loss(0.5, 0.5), 0.0, 24);
        for w in &weighed {
            assert!((w.adjustment - 0.5 * w.weight.ln()).abs() < 1e-6, "{weighed:?}");
        }
        assert!(weighed[3].weight > 2.0 * weighed[0].weight);

        // As `sample_rays` draws: three in ten labels are the rarest of four.
        let drawn = counts.ray_weights(&loss(0.0, 1.0), 0.3, 4);
        let label = |i: u32, k: u32| match random_u32(3, 0, i, k) % 1000 {
            0..700 => 0,
            700..950 => 2,
            _ => 3_usize,
        };
        let n = 200_000;
        let mut found = [0.0_f64; 4];
        for i in 0..n {
            let candidates = if i % 10 < 3 { 4 } else { 1 };
            let rarest = (0..candidates).map(|k| label(i, k)).max().unwrap();
            found[rarest] += 1.0 / f64::from(n);
        }
        for (c, w) in drawn.iter().enumerate().filter(|(c, _)| *c != 1) {
            let expected = counts.0[c] / 1000.0 * f64::from(w.adjustment).exp();
            assert!(
                (found[c] - expected).abs() < 0.01 * expected.max(0.1),
                "{c}: {found:?} {drawn:?}"
            );
        }
    }
}
