//! The mathematics that several crates need: symmetric matrices and reproducible random numbers.
//!
//! The order of operations is part of each function: trajectories depend on it to the last bit.
use alloc::vec::Vec;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Most sweeps of [`eigen_symmetric`]. Convergence is quadratic: six or so reach rounding error.
const MAX_SWEEPS: usize = 40;

/// Returns the eigenvalues (ascending) and eigenvectors (`vectors[i]` belongs to `values[i]`) of a
/// symmetric matrix, by cyclic Jacobi rotations.
pub fn eigen_symmetric<const N: usize>(matrix: &[[f64; N]; N]) -> ([f64; N], [[f64; N]; N]) {
    let mut a = *matrix;
    let mut v = identity::<N>();
    for _ in 0..MAX_SWEEPS {
        let mut off = 0.0;
        let mut diagonal = 0.0;
        for i in 0..N {
            diagonal += a[i][i] * a[i][i];
            for j in 0..i {
                off += a[i][j] * a[i][j];
            }
        }
        if off <= 1e-30 * diagonal || !off.is_finite() {
            break;
        }
        for p in 0..N {
            for q in p + 1..N {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..N {
                    let (x, y) = (a[k][p], a[k][q]);
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for k in 0..N {
                    let (x, y) = (a[p][k], a[q][k]);
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for k in 0..N {
                    let (x, y) = (v[p][k], v[q][k]);
                    v[p][k] = c * x - s * y;
                    v[q][k] = s * x + c * y;
                }
            }
        }
    }
    let mut order: Vec<usize> = (0..N).collect();
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    (core::array::from_fn(|i| a[order[i]][order[i]]), core::array::from_fn(|i| v[order[i]]))
}

/// Returns the identity matrix.
pub fn identity<const N: usize>() -> [[f64; N]; N] {
    let mut m = [[0.0; N]; N];
    for (i, row) in m.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    m
}

/// Solves a dense symmetric positive definite system in place by Cholesky's factorisation: `a` is
/// row-major n x n and is overwritten by its lower factor, `b` by the solution. Returns `false`
/// when a pivot is not above `least_pivot` times the diagonal entry it comes from (0 for any
/// positive definite matrix); `b` is then as it was.
pub fn solve_cholesky(a: &mut [f64], b: &mut [f64], least_pivot: f64) -> bool {
    let n = b.len();
    for j in 0..n {
        for i in j..n {
            let entry = a[i * n + j];
            let mut sum = entry;
            for k in 0..j {
                sum -= a[i * n + k] * a[j * n + k];
            }
            if i == j {
                if sum.is_nan() || sum <= 0.0 || sum <= least_pivot * entry {
                    return false;
                }
                a[j * n + j] = sum.sqrt();
            } else {
                a[i * n + j] = sum / a[j * n + j];
            }
        }
    }
    for i in 0..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= a[i * n + k] * b[k];
        }
        b[i] = sum / a[i * n + i];
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= a[k * n + i] * b[k];
        }
        b[i] = sum / a[i * n + i];
    }
    true
}

/// Mixes 32 bits: one step of PCG's generator and its output permutation, as a hash. The kernels
/// have the same function.
#[inline]
pub fn pcg(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Random numbers by counting: number `n` of a seed and a stream is a hash of the three, so that
/// streams are independent of each other and of how much of another is drawn.
#[derive(Clone, Debug)]
pub struct Random {
    key: u32,
    counter: u32,
}

impl Random {
    /// Begins the sequence of a seed and a stream.
    pub fn new(seed: u32, stream: u32) -> Random {
        Random { key: pcg(seed.wrapping_add(pcg(stream))), counter: 0 }
    }

    /// Returns the next 32 bits.
    pub fn bits(&mut self) -> u32 {
        self.counter = self.counter.wrapping_add(1);
        pcg(pcg(self.counter) ^ self.key)
    }

    /// Returns the next number, uniform in \[0, 1) with 53 bits.
    pub fn uniform(&mut self) -> f64 {
        let bits = u64::from(self.bits()) << 21 ^ u64::from(self.bits()) >> 11;
        bits as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_rebuild_the_matrix() {
        let mut m = identity::<6>();
        for i in 0..6 {
            for j in 0..6 {
                m[i][j] += 0.3 * ((i * j) as f64).cos() + if i == j { i as f64 } else { 0.0 };
            }
        }
        let (values, vectors) = eigen_symmetric(&m);
        assert!(values.is_sorted());
        for i in 0..6 {
            for j in 0..6 {
                let x: f64 = (0..6).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                assert!((x - m[i][j]).abs() < 1e-10, "{i} {j}: {x} {}", m[i][j]);
            }
        }
    }

    #[test]
    fn cholesky_solves_and_refuses() {
        let full = [4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0];
        let (mut a, mut b) = (full, [1.0, 2.0, 3.0]);
        assert!(solve_cholesky(&mut a, &mut b, 0.0));
        for i in 0..3 {
            let x: f64 = (0..3).map(|j| full[i * 3 + j] * b[j]).sum();
            assert!((x - [1.0, 2.0, 3.0][i]).abs() < 1e-12);
        }
        assert!(!solve_cholesky(&mut [-1.0], &mut [1.0], 0.0));
        assert!(!solve_cholesky(&mut [f64::NAN], &mut [1.0], 0.0));
        let nearly_singular = [1.0, 1.0, 1.0, 1.0 + 1e-14];
        for (least_pivot, solved) in [(0.0, true), (1e-12, false)] {
            let (mut a, mut b) = (nearly_singular, [1.0, 1.0]);
            assert_eq!(solve_cholesky(&mut a, &mut b, least_pivot), solved, "{least_pivot}");
        }
    }

    #[test]
    fn random_numbers_are_reproducible_and_uniform() {
        // The first numbers of the kernels' generator.
        assert_eq!([pcg(0), pcg(1), pcg(u32::MAX)], [129_708_002, 2_831_084_092, 3_861_530_882]);
        let draw = |seed, stream| Random::new(seed, stream).uniform();
        assert_eq!(draw(1, 2), draw(1, 2));
        assert_ne!(draw(1, 2), draw(1, 3));
        assert_ne!(draw(1, 2), draw(2, 2));
        let mut random = Random::new(7, 0);
        let numbers: Vec<f64> = (0..10_000).map(|_| random.uniform()).collect();
        assert!(numbers.iter().all(|x| (0.0..1.0).contains(x)));
        let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
    }
}
