//! Small dense linear algebra in f64: what a 6-vector twist needs.
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// A symmetric 6x6 matrix, rows.
pub type Mat6 = [[f64; 6]; 6];

/// Eigenvalues (ascending) and eigenvectors (`vectors[i]` belongs to `values[i]`) of a symmetric
/// matrix, by cyclic Jacobi rotations.
pub fn eigen6(m: &Mat6) -> ([f64; 6], Mat6) {
    let mut a = *m;
    let mut v = identity6();
    for _ in 0..40 {
        let mut off = 0.0;
        let mut diagonal = 0.0;
        for i in 0..6 {
            diagonal += a[i][i] * a[i][i];
            for j in 0..i {
                off += a[i][j] * a[i][j];
            }
        }
        if off <= 1e-30 * diagonal || !off.is_finite() {
            break;
        }
        for p in 0..5 {
            for q in p + 1..6 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..6 {
                    let (x, y) = (a[k][p], a[k][q]);
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for k in 0..6 {
                    let (x, y) = (a[p][k], a[q][k]);
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for k in 0..6 {
                    let (x, y) = (v[p][k], v[q][k]);
                    v[p][k] = c * x - s * y;
                    v[q][k] = s * x + c * y;
                }
            }
        }
    }
    let mut order = [0usize, 1, 2, 3, 4, 5];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    (order.map(|i| a[i][i]), order.map(|i| v[i]))
}

/// The identity.
pub fn identity6() -> Mat6 {
    let mut m = [[0.0; 6]; 6];
    for (i, row) in m.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    m
}

/// `d^T m d` for a block-diagonal `d` made of the 3x3 matrix `r` twice (`r[row][column]`).
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

/// Solution of `h x = -b` with Levenberg-Marquardt damping `lambda`, restricted to the directions
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
    let (values, vectors) = eigen6(&m);
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

/// Solve a dense symmetric positive definite system in place by Cholesky (`a` row-major n x n);
/// `false` when it is not positive definite.
pub fn solve_cholesky(a: &mut [f64], b: &mut [f64]) -> bool {
    let n = b.len();
    for j in 0..n {
        for i in j..n {
            let mut sum = a[i * n + j];
            for k in 0..j {
                sum -= a[i * n + k] * a[j * n + k];
            }
            if i == j {
                if sum.is_nan() || sum <= 0.0 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_rebuild_the_matrix() {
        let mut m = identity6();
        for i in 0..6 {
            for j in 0..6 {
                m[i][j] += 0.3 * ((i * j) as f64).cos() + if i == j { i as f64 } else { 0.0 };
            }
        }
        let (values, vectors) = eigen6(&m);
        for i in 0..6 {
            for j in 0..6 {
                let x: f64 = (0..6).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                assert!((x - m[i][j]).abs() < 1e-10, "{i} {j}: {x} {}", m[i][j]);
            }
        }
    }

    #[test]
    fn an_unconstrained_direction_is_left_alone() {
        let mut h = identity6();
        h[2][2] = 1e-12;
        let (step, values, left_out) = solve_constrained(&h, &[1.0; 6], 0.0, 1.0, 1e-6);
        assert_eq!(left_out, 1);
        assert_eq!(step[2], 0.0);
        assert!((step[0] + 1.0).abs() < 1e-12 && values[0] < 1e-11);
    }

    #[test]
    fn cholesky_solves() {
        let mut a = [4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0];
        let full = a;
        let mut b = [1.0, 2.0, 3.0];
        assert!(solve_cholesky(&mut a, &mut b));
        for i in 0..3 {
            let x: f64 = (0..3).map(|j| full[i * 3 + j] * b[j]).sum();
            assert!((x - [1.0, 2.0, 3.0][i]).abs() < 1e-12);
        }
        assert!(!solve_cholesky(&mut [-1.0], &mut [1.0]));
    }
}
