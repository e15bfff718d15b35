//! Damped Gauss-Newton on a pose from normal equations that the engine sums; solved in f64.
use crate::{kernels::align_points::ALIGN_ROW, pose::Pose};
use mte_slam_types::maths::solve_cholesky;

/// When a result is not to be trusted.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    /// Points offered to the field.
    pub offered: usize,
    /// Least share of them near a surface of the map.
    pub min_share: f64,
    /// Largest correction \[m\].
    pub max_translation_m: f64,
    /// Largest correction \[rad\].
    pub max_rotation_rad: f64,
}

impl Default for Guard {
    fn default() -> Self {
        Guard { offered: 0, min_share: 0.3, max_translation_m: 0.03, max_rotation_rad: 0.03 }
    }
}

/// Levenberg-Marquardt, one evaluation per step.
#[derive(Clone, Debug)]
pub struct Solver {
    start: Pose,
    best: Pose,
    candidate: Pose,
    best_cost: f64,
    damping: f64,
    weight: f64,
    /// Information of the start, for left retractions.
    prior: [[f64; 6]; 6],
    accepted: u32,
    guard: Guard,
    refused: bool,
    last: Option<([[f64; 6]; 6], [f64; 6])>,
}

/// Solves A x = b for a symmetric positive definite A; `None` if it is not.
fn solve6(a: &[[f64; 6]; 6], b: &[f64; 6]) -> Option<[f64; 6]> {
    let (mut a, mut x) = (*a, *b);
    let solved = solve_cholesky(a.as_flattened_mut(), &mut x, 1e-12);
    (solved && x.iter().all(|v| v.is_finite())).then_some(x)
}

impl Solver {
    /// Starts at a pose known with `prior` information (for left retractions); `weight` scales the
    /// engine's sums against it.
    pub fn new(start: Pose, prior: [[f64; 6]; 6], weight: f64, guard: Guard) -> Solver {
        Solver {
            start,
            best: start,
            candidate: start,
            best_cost: f64::INFINITY,
            damping: 1e-4,
            weight,
            prior,
            accepted: 0,
            guard,
            refused: false,
            last: None,
        }
    }

    /// The pose to evaluate next.
    pub fn candidate(&self) -> Pose {
        self.candidate
    }

    /// Takes the sums at the candidate; true when done.
    pub fn step(&mut self, sums: &[f64; ALIGN_ROW]) -> bool {
        let points = sums[29];
        if !sums.iter().all(|v| v.is_finite())
            || points < self.guard.min_share * self.guard.offered as f64
            || points < 50.0
        {
            self.refused = self.accepted == 0;
            return true;
        }
        let away = self.away();
        let pull: [f64; 6] =
            core::array::from_fn(|i| (0..6).map(|j| self.prior[i][j] * away[j]).sum());
        let prior_cost: f64 = (0..6).map(|i| away[i] * pull[i]).sum();
        let cost = self.weight * (sums[27] + sums[28]) / points + prior_cost / points;
        if cost < self.best_cost {
            let gain = self.best_cost - cost;
            self.best = self.candidate;
            self.best_cost = cost;
            self.accepted += 1;
            self.damping = (self.damping * 0.3).max(1e-7);
            let mut h = [[0.0; 6]; 6];
            let mut k = 0;
            for a in 0..6 {
                for b in a..6 {
                    h[a][b] = sums[k] * self.weight + self.prior[a][b];
                    h[b][a] = h[a][b];
                    k += 1;
                }
            }
            let g = core::array::from_fn(|i| -sums[21 + i] * self.weight - pull[i]);
            self.last = Some((h, g));
            if gain < 1e-4 * cost {
                return true;
            }
        } else {
            self.damping *= 10.0;
            if self.damping > 1e3 {
                return true;
            }
        }
        let Some((mut h, g)) = self.last else { return true };
        for (i, row) in h.iter_mut().enumerate() {
            row[i] *= 1.0 + self.damping;
        }
        let Some(x) = solve6(&h, &g) else {
            self.refused = self.accepted <= 1;
            return true;
        };
        self.candidate = self.best.retract(&x);
        x.iter().all(|v| v.abs() < 1e-6)
    }

    /// The candidate as a retraction of the start.
    fn away(&self) -> [f64; 6] {
        let v = self.candidate.translation - self.start.translation;
        let q = self.candidate.rotation.mul_mat3(&self.start.rotation.transpose());
        // The skew part is the rotation vector to second order, and corrections are small.
        let w = [
            0.5 * (q.y_axis.z - q.z_axis.y),
            0.5 * (q.z_axis.x - q.x_axis.z),
            0.5 * (q.x_axis.y - q.y_axis.x),
        ];
        [v.x, v.y, v.z, w[0], w[1], w[2]]
    }

    /// The refined pose, or `None` when a guard refused it.
    pub fn result(&self) -> Option<Pose> {
        let change = self.start.inverse().compose(&self.best);
        let small = change.translation.length() <= self.guard.max_translation_m
            && change.angle_rad() <= self.guard.max_rotation_rad;
        (!self.refused && self.accepted > 0 && small).then_some(self.best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_between_prior_and_field() {
        // A field that wants x = 0.01 m as strongly as the prior wants 0.
        let mut prior = [[0.0; 6]; 6];
        (0..6).for_each(|i| prior[i][i] = 100.0);
        let guard = Guard { offered: 100, ..Guard::default() };
        let mut solver = Solver::new(Pose::IDENTITY, prior, 1.0, guard);
        for _ in 0..20 {
            let e = solver.candidate().translation.x - 0.01;
            let mut sums = [0.0; ALIGN_ROW];
            sums[0] = 100.0;
            sums[21] = 100.0 * e;
            sums[27] = 100.0 * e * e;
            sums[29] = 100.0;
            if solver.step(&sums) {
                break;
            }
        }
        assert!((solver.result().unwrap().translation.x - 0.005).abs() < 1e-5);
    }

    #[test]
    fn solves_and_refuses() {
        let mut a = [[0.1; 6]; 6];
        for i in 0..6 {
            a[i][i] = 2.0 + i as f64;
        }
        let x = [1.0, -2.0, 3.0, 0.5, -0.25, 4.0];
        let b = core::array::from_fn(|i| (0..6).map(|j| a[i][j] * x[j]).sum());
        let y = solve6(&a, &b).unwrap();
        for i in 0..6 {
            assert!((x[i] - y[i]).abs() < 1e-9);
        }
        a[3] = [0.0; 6];
        assert!(solve6(&a, &b).is_none());
    }
}
