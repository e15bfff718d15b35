//! Keyframe poses that agree with all pairwise alignments.
use super::linear::solve_cholesky;
use alloc::{vec, vec::Vec};
use glam::{DMat3, DVec3};
use mte_slam_types::pose::Pose;
use serde::{Deserialize, Serialize};

/// A measured relative pose.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Edge {
    /// Index of the reference node.
    pub i: usize,
    /// Index of the other node.
    pub j: usize,
    /// Measured `i_from_j`.
    pub i_from_j: Pose,
    /// Inverse covariance of the twist of [`Pose::retract`] on `i_from_j`.
    pub information: [[f64; 6]; 6],
}

/// Poses tied by relative measurements.
#[derive(Clone, Debug, Default)]
pub struct PoseGraph {
    /// `world_from_camera` of each node.
    pub poses: Vec<Pose>,
    /// The measurements.
    pub edges: Vec<Edge>,
}

/// Rotation vector of a rotation matrix.
fn log_rotation(r: &DMat3) -> DVec3 {
    let q = Pose { rotation: *r, translation: DVec3::ZERO }.quaternion();
    let v = DVec3::new(q.x, q.y, q.z);
    let s = v.length();
    if s < 1e-12 {
        return 2.0 * v;
    }
    let angle = 2.0 * num_traits::Float::atan2(s, q.w.abs());
    v * (angle / s * if q.w < 0.0 { -1.0 } else { 1.0 })
}

impl PoseGraph {
    /// Gauss-Newton over the poses from `first_free` on; the ones before stay. Edges that disagree
    /// with the rest lose weight (Geman-McClure with width `kernel` times the median error).
    /// Returns the mean robust cost before and after.
    pub fn optimise(&mut self, first_free: usize, iterations: usize, kernel: f64) -> (f64, f64) {
        let first = first_free.max(1);
        let n = self.poses.len().saturating_sub(first);
        let mut costs = (0.0, 0.0);
        if n == 0 || self.edges.is_empty() {
            return costs;
        }
        for iteration in 0..=iterations {
            let errors: Vec<[f64; 6]> = self.edges.iter().map(|e| self.error(e)).collect();
            let squares: Vec<f64> = errors
                .iter()
                .zip(&self.edges)
                .map(|(e, edge)| quadratic(&edge.information, e))
                .collect();
            let mut sorted = squares.clone();
            sorted.sort_by(f64::total_cmp);
            let width = kernel * kernel * sorted[sorted.len() / 2].max(1e-12);
            let cost =
                squares.iter().map(|s| s * width / (width + s)).sum::<f64>() / squares.len() as f64;
            if iteration == 0 {
                costs.0 = cost;
            }
            costs.1 = cost;
            if iteration == iterations {
                break;
            }
            let size = 6 * n;
            let mut h = vec![0.0; size * size];
            let mut b = vec![0.0; size];
            for ((edge, e), s) in self.edges.iter().zip(&errors).zip(&squares) {
                let k = width / (width + s);
                let (ji, jj) = self.jacobians(edge);
                self.add(&mut h, &mut b, first, size, edge, e, k * k, &ji, &jj);
            }
            let mut largest = 0.0f64;
            for i in 0..size {
                largest = largest.max(h[i * size + i]);
            }
            for i in 0..size {
                h[i * size + i] += 1e-9 * largest + 1e-12;
            }
            b.iter_mut().for_each(|x| *x = -*x);
            if !solve_cholesky(&mut h, &mut b) || b.iter().any(|x| !x.is_finite()) {
                break;
            }
            for k in 0..n {
                let step = core::array::from_fn(|i| b[6 * k + i]);
                self.poses[first + k] = self.poses[first + k].retract(&step);
            }
            if b.iter().all(|x| x.abs() < 1e-7) {
                break;
            }
        }
        costs
    }

    fn error(&self, edge: &Edge) -> [f64; 6] {
        let now = self.poses[edge.i].inverse().compose(&self.poses[edge.j]);
        let t = now.translation - edge.i_from_j.translation;
        let w = log_rotation(&(now.rotation * edge.i_from_j.rotation.transpose()));
        [t.x, t.y, t.z, w.x, w.y, w.z]
    }

    /// Derivatives of the error by the retraction twists of both poses.
    fn jacobians(&self, edge: &Edge) -> ([[f64; 6]; 6], [[f64; 6]; 6]) {
        let (a, b) = (&self.poses[edge.i], &self.poses[edge.j]);
        let rt = a.rotation.transpose();
        let d = b.translation - a.translation;
        // d x w as a matrix acting on w.
        let skew = DMat3::from_cols(
            DVec3::new(0.0, d.z, -d.y),
            DVec3::new(-d.z, 0.0, d.x),
            DVec3::new(d.y, -d.x, 0.0),
        );
        let turn = rt * skew;
        let (mut ji, mut jj) = ([[0.0; 6]; 6], [[0.0; 6]; 6]);
        for c in 0..3 {
            let (r, s) = (rt.col(c).to_array(), turn.col(c).to_array());
            for k in 0..3 {
                jj[k][c] = r[k];
                ji[k][c] = -r[k];
                jj[3 + k][3 + c] = r[k];
                ji[3 + k][3 + c] = -r[k];
                ji[k][3 + c] = s[k];
            }
        }
        (ji, jj)
    }

    fn add(
        &self,
        h: &mut [f64],
        b: &mut [f64],
        first: usize,
        size: usize,
        edge: &Edge,
        e: &[f64; 6],
        weight: f64,
        ji: &[[f64; 6]; 6],
        jj: &[[f64; 6]; 6],
    ) {
        let ends = [(edge.i, ji), (edge.j, jj)];
        for (na, ja) in ends {
            if na < first {
                continue;
            }
            // ja^T information
            let mut left = [[0.0; 6]; 6];
            for r in 0..6 {
                for c in 0..6 {
                    left[r][c] =
                        (0..6).map(|k| ja[k][r] * edge.information[k][c]).sum::<f64>() * weight;
                }
            }
            let row = 6 * (na - first);
            for r in 0..6 {
                b[row + r] += (0..6).map(|k| left[r][k] * e[k]).sum::<f64>();
            }
            for (nb, jb) in ends {
                if nb < first {
                    continue;
                }
                let column = 6 * (nb - first);
                for r in 0..6 {
                    for c in 0..6 {
                        h[(row + r) * size + column + c] +=
                            (0..6).map(|k| left[r][k] * jb[k][c]).sum::<f64>();
                    }
                }
            }
        }
    }
}

fn quadratic(m: &[[f64; 6]; 6], e: &[f64; 6]) -> f64 {
    (0..6).map(|i| e[i] * (0..6).map(|j| m[i][j] * e[j]).sum::<f64>()).sum()
}
