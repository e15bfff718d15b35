//! Small dense linear algebra in f64: what a 6-vector twist needs.
use mte_slam_types::maths::{self, eigen_symmetric};

/// A symmetric 6x6 matrix, rows.
pub type Mat6 = [[f64; 6]; 6];

/// Solves a dense symmetric positive definite system in place (`a` row-major n x n); `false` when
/// it is not positive definite.
pub fn solve_cholesky(a: &mut [f64], b: &mut [f64]) -> bool {
    maths::solve_cholesky(a, b, 0.0)
}

/// Returns `d^T m d` for a block-diagonal `d` made of the 3x3 matrix `r` twice (`r[row][column]`).
pub fn congruence(m: &Mat6, r: &[[f64; 3]; 3]) -> Mat6 {
    let mut half = [[0.0; 6]; 6];
    let mut out = [[0.0; 6]; 6];
    for i in 0..6 {
        for j in 0..6 {
            let block = j / 3 * 3;
            half[i][j] = (0..3).map(|k| m[i][block + k] * r[k][j - block]).sum();
        }
    }
    for i in 0..6 {
        let block = i / 3 * 3;
        for j in 0..6 {
            out[i][j] = (0..3).map(|k| r[k][i - block] * half[block + k][j]).sum();
        }
    }
    out
}

/// Solves `h x = -b` with Levenberg-Marquardt damping `lambda`, restricted to the directions
/// that the data constrain: in coordinates where a rotation counts as the motion it causes at
/// `lever_m`, eigenvectors with less than `ratio` of the largest eigenvalue are left alone.
/// Returns the step, the eigenvalues in those coordinates (ascending) and how many were left out.
pub fn solve_constrained(
    h: &Mat6,
    b: &[f64; 6],
    lambda: f64,
    lever_m: f64,
    ratio: f64,
) -> ([f64; 6], [f64; 6], usize) {
    let scale = [1.0, 1.0, 1.0, 1.0 / lever_m, 1.0 / lever_m, 1.0 / lever_m];
    let mut m = *h;
    for i in 0..6 {
        for j in 0..6 {
            m[i][j] *= scale[i] * scale[j];
        }
    }
    let (values, vectors) = eigen_symmetric(&m);
    let largest = values[5];
    let mut step = [0.0; 6];
    let mut left_out = 0;
    if largest.is_nan() || largest <= 0.0 || largest.is_infinite() {
        return (step, values, 6);
    }
    for (value, vector) in values.iter().zip(&vectors) {
        if *value <= ratio * largest {
            left_out += 1;
            continue;
        }
        let along: f64 = (0..6).map(|i| vector[i] * b[i] * scale[i]).sum();
        // Damping relative to each eigenvalue shortens the step without turning it; the absolute
        // part keeps weak directions from running away while the step is uncertain.
        let x = -along / (value * (1.0 + lambda) + lambda * 1e-2 * largest);
        for i in 0..6 {
            step[i] += x * vector[i] * scale[i];
        }
    }
    (step, values, left_out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_types::maths::identity;

    #[test]
    fn an_unconstrained_direction_is_left_alone() {
        let mut h = identity::<6>();
        h[2][2] = 1e-12;
        let (step, values, left_out) = solve_constrained(&h, &[1.0; 6], 0.0, 1.0, 1e-6);
        assert_eq!(left_out, 1);
        assert_eq!(step[2], 0.0);
        assert!((step[0] + 1.0).abs() < 1e-12 && values[0] < 1e-11);
    }
}
