//! Trajectory errors. The caller passes pairs of estimated and true poses; frames that are lost
//! or have no finite truth are left out before.
use alloc::{string::String, vec::Vec};
use glam::{DMat3, DQuat, DVec3};
use mte_slam_types::{maths::eigen_symmetric, pose::Pose};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;
use serde::Serialize;

/// Why a trajectory error cannot be said.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// Too few pairs for the figure.
    #[error("{what}: found {found} pairs of poses, expected at least {expected}")]
    TooFew {
        /// Which figure.
        what: &'static str,
        /// Pairs given.
        found: usize,
        /// Pairs needed.
        expected: usize,
    },
    /// A pose with a NaN or an infinity.
    #[error("pair {pair}: found a non-finite {which} pose, expected finite numbers")]
    NotFinite {
        /// Position in the list.
        pair: usize,
        /// `estimated` or `true`.
        which: &'static str,
    },
}

/// An estimated pose and the true one of the same frame, both `world_from_camera`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePair {
    /// What the system said.
    pub estimate: Pose,
    /// What it should have said.
    pub truth: Pose,
}

/// Mean, median and so on of a list of errors, in the unit of the list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorSummary {
    /// Root of the mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median (mean of the middle two of an even number).
    pub median: f64,
    /// Largest.
    pub max: f64,
}

impl ErrorSummary {
    /// Summary of non-negative errors; zeros for none.
    pub fn of(errors: &[f64]) -> ErrorSummary {
        let n = errors.len();
        if n == 0 {
            return ErrorSummary::default();
        }
        let mut sorted: Vec<f64> = errors.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let mean = |f: &dyn Fn(f64) -> f64| errors.iter().map(|&e| f(e)).sum::<f64>() / n as f64;
        ErrorSummary {
            rmse: mean(&|e| e * e).sqrt(),
            mean: mean(&|e| e),
            median: (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0,
            max: sorted[n - 1],
        }
    }
}

/// Absolute trajectory error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AteReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]).
    pub protocol_id: String,
    /// What the figures mean.
    pub protocol: String,
    /// Number of pairs.
    pub pairs: usize,
    /// After the best rigid alignment, without scale \[cm\].
    pub aligned_cm: ErrorSummary,
    /// Without any alignment \[cm\].
    pub unaligned_cm: ErrorSummary,
    /// Whether the alignment's rotation is unique; not so for positions on a line or at a point.
    /// The aligned figures hold all the same.
    pub alignment_unique: bool,
}

/// Relative pose error from each pair to the one `delta` further on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RpeReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]).
    pub protocol_id: String,
    /// What the figures mean.
    pub protocol: String,
    /// Distance of the two poses compared, in pairs of the list.
    pub delta: usize,
    /// Number of relative motions.
    pub motions: usize,
    /// Translation \[cm\].
    pub translation_cm: ErrorSummary,
    /// Rotation angle \[degrees\].
    pub rotation_deg: ErrorSummary,
}

/// A least-squares rigid alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidAlignment {
    /// Maps source points onto target points.
    pub target_from_source: Pose,
    /// Whether the rotation is the only best one.
    pub unique: bool,
}

/// Returns the rigid transform (no scale) that maps `source` points onto `target` points with the least
/// sum of squared distances: Horn's quaternion method, which equals Umeyama's without scale.
///
/// # Errors
/// [`TrajectoryError::TooFew`] under 3 points (lists are cut to the shorter).
pub fn align_rigid(source: &[DVec3], target: &[DVec3]) -> Result<RigidAlignment, TrajectoryError> {
    let n = source.len().min(target.len());
    if n < 3 {
        return Err(TrajectoryError::TooFew { what: "rigid alignment", found: n, expected: 3 });
    }
    let mean = |p: &[DVec3]| p[..n].iter().sum::<DVec3>() / n as f64;
    let (source_mean, target_mean) = (mean(source), mean(target));
    let mut s = [[0f64; 3]; 3];
    let mut scale = 0.0;
    for (a, b) in source.iter().zip(target) {
        let (a, b) = (*a - source_mean, *b - target_mean);
        scale += a.length() * b.length();
        for i in 0..3 {
            for j in 0..3 {
                s[i][j] += a[i] * b[j];
            }
        }
    }
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
    let m = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    let (values, vectors) = eigen_symmetric(&m);
    let [w, x, y, z] = vectors[3];
    let rotation = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
    let translation = target_mean - rotation * source_mean;
    let gap = values[3] - values[2];
    Ok(RigidAlignment {
        target_from_source: Pose { rotation, translation },
        unique: gap > 1e-9 * scale && scale > 0.0,
    })
}

fn check_finite(pairs: &[PosePair]) -> Result<(), TrajectoryError> {
    for (pair, p) in pairs.iter().enumerate() {
        for (pose, which) in [(&p.estimate, "estimated"), (&p.truth, "true")] {
            if !pose.is_finite() {
                return Err(TrajectoryError::NotFinite { pair, which });
            }
        }
    }
    Ok(())
}

/// Absolute trajectory error of the positions.
///
/// # Errors
/// Fewer than 3 pairs, or a pose that is not finite.
pub fn ate(pairs: &[PosePair]) -> Result<AteReport, TrajectoryError> {
    check_finite(pairs)?;
    let estimate: Vec<DVec3> = pairs.iter().map(|p| p.estimate.translation).collect();
    let truth: Vec<DVec3> = pairs.iter().map(|p| p.truth.translation).collect();
    let alignment = align_rigid(&estimate, &truth)?;
    let errors_cm = |pose: &Pose| {
        let distance = |(e, t): (&DVec3, &DVec3)| pose.transform_point(*e).distance(*t) * 100.0;
        ErrorSummary::of(&estimate.iter().zip(&truth).map(distance).collect::<Vec<_>>())
    };
    Ok(AteReport {
        protocol_id: crate::protocol::ATE.into(),
        protocol: "ATE: translation, SE(3) Umeyama without scale, frames with finite truth".into(),
        pairs: pairs.len(),
        aligned_cm: errors_cm(&alignment.target_from_source),
        unaligned_cm: errors_cm(&Pose::IDENTITY),
        alignment_unique: alignment.unique,
    })
}

/// Relative pose error over `delta` steps of the list (1: from each pair to the next).
///
/// # Errors
/// No motion to compare (`delta` 0, or not more than `delta` pairs), or a pose that is not finite.
pub fn rpe(pairs: &[PosePair], delta: usize) -> Result<RpeReport, TrajectoryError> {
    check_finite(pairs)?;
    if delta == 0 || pairs.len() <= delta {
        let (found, expected) = (pairs.len(), delta.max(1) + 1);
        return Err(TrajectoryError::TooFew { what: "relative pose error", found, expected });
    }
    let errors: Vec<Pose> = (delta..pairs.len())
        .map(|i| {
            let (a, b) = (&pairs[i - delta], &pairs[i]);
            let motion = |from: &Pose, to: &Pose| from.inverse().compose(to);
            motion(&a.truth, &b.truth).inverse().compose(&motion(&a.estimate, &b.estimate))
        })
        .collect();
    let summary =
        |f: &dyn Fn(&Pose) -> f64| ErrorSummary::of(&errors.iter().map(f).collect::<Vec<_>>());
    Ok(RpeReport {
        protocol_id: crate::protocol::rpe(delta),
        protocol: alloc::format!("RPE: relative motion over {delta} frame(s), no alignment"),
        delta,
        motions: errors.len(),
        translation_cm: summary(&|e| e.translation.length() * 100.0),
        rotation_deg: summary(&|e| e.angle_rad().to_degrees()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_types::maths::Random;

    /// Returns a smooth random path, and estimates with noise after a rigid motion of the world.
    fn random_pairs(seed: u32, n: usize, noise_m: f64, world: &Pose) -> Vec<PosePair> {
        let mut rng = Random::new(seed, 0);
        let mut random = |size: f64| (rng.uniform() * 2.0 - 1.0) * size;
        let mut truth = Pose::IDENTITY;
        (0..n)
            .map(|_| {
                let twist: [f64; 6] = core::array::from_fn(|_| random(0.1));
                truth = truth.retract(&twist);
                let noise: [f64; 6] = core::array::from_fn(|_| random(noise_m));
                PosePair { estimate: world.compose(&truth.retract(&noise)), truth }
            })
            .collect()
    }

    #[test]
    fn alignment_undoes_a_rigid_motion() {
        let world = Pose::from_twist(&[3.0, -1.0, 0.5, 2.0, 1.5, -1.0]);
        let report = ate(&random_pairs(1, 100, 0.0, &world)).unwrap();
        assert!(report.aligned_cm.max < 1e-10 && report.alignment_unique);
        assert!(report.unaligned_cm.rmse > 100.0);
        assert_eq!(report.pairs, 100);
    }

    #[test]
    fn no_small_motion_improves_the_alignment() {
        let world = Pose::from_twist(&[0.3, -1.0, 0.5, 0.2, 0.5, -1.0]);
        let pairs = random_pairs(2, 60, 0.05, &world);
        let source: Vec<_> = pairs.iter().map(|p| p.estimate.translation).collect();
        let target: Vec<_> = pairs.iter().map(|p| p.truth.translation).collect();
        let best = align_rigid(&source, &target).unwrap().target_from_source;
        assert!((best.rotation.determinant() - 1.0).abs() < 1e-12);
        let cost = |pose: &Pose| -> f64 {
            let pairs = source.iter().zip(&target);
            pairs.map(|(s, t)| pose.transform_point(*s).distance_squared(*t)).sum()
        };
        for i in 0..12 {
            let mut twist = [0.0; 6];
            twist[i / 2] = if i % 2 == 0 { 1e-4 } else { -1e-4 };
            assert!(cost(&best.retract(&twist)) > cost(&best), "{i}");
        }
    }

    #[test]
    fn mirrored_points_still_get_a_rotation() {
        let source: Vec<DVec3> =
            random_pairs(3, 30, 0.0, &Pose::IDENTITY).iter().map(|p| p.truth.translation).collect();
        let target: Vec<DVec3> = source.iter().map(|p| DVec3::new(-p.x, p.y, p.z)).collect();
        let r = align_rigid(&source, &target).unwrap().target_from_source.rotation;
        assert!((r.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn degenerate_paths_are_told_and_bad_ones_refused() {
        let at = |p: DVec3| PosePair {
            estimate: Pose { translation: p + DVec3::X, ..Pose::IDENTITY },
            truth: Pose { translation: p, ..Pose::IDENTITY },
        };
        let line: Vec<_> = (0..9).map(|i| at(DVec3::splat(f64::from(i)))).collect();
        let report = ate(&line).unwrap();
        assert!(!report.alignment_unique && report.aligned_cm.max < 1e-9);
        assert!((report.unaligned_cm.mean - 100.0).abs() < 1e-9);
        let still = ate(&vec![at(DVec3::ONE); 5]).unwrap();
        assert!(!still.alignment_unique && still.aligned_cm.max < 1e-9);
        assert!(matches!(ate(&line[..2]), Err(TrajectoryError::TooFew { found: 2, .. })));
        let mut bad = line;
        bad[4].truth.translation.y = f64::NAN;
        let e = ate(&bad).unwrap_err();
        assert_eq!(e, TrajectoryError::NotFinite { pair: 4, which: "true" });
        assert!(rpe(&bad[..1], 1).is_err() && rpe(&bad[..3], 0).is_err());
    }

    #[test]
    fn rpe_measures_drift_per_step() {
        let step = Pose::from_twist(&[0.0, 0.0, 0.01, 0.0, 0.002, 0.0]);
        let mut pairs = random_pairs(4, 20, 0.0, &Pose::IDENTITY);
        // Each estimated motion is the true one followed by the step.
        for i in 1..pairs.len() {
            let motion = pairs[i - 1].truth.inverse().compose(&pairs[i].truth);
            pairs[i].estimate = pairs[i - 1].estimate.compose(&motion).compose(&step);
        }
        let report = rpe(&pairs, 1).unwrap();
        assert_eq!(report.motions, 19);
        assert!((report.rotation_deg.mean - 0.002f64.to_degrees()).abs() < 1e-9);
        assert!((report.translation_cm.rmse - 1.0).abs() < 1e-9);
        assert!(rpe(&pairs, 10).unwrap().translation_cm.mean > 3.0);
    }

    #[test]
    fn summary_of_known_numbers() {
        let s = ErrorSummary::of(&[3.0, 1.0, 2.0, 6.0]);
        assert_eq!((s.mean, s.median, s.max), (3.0, 2.5, 6.0));
        assert!((s.rmse - 12.5f64.sqrt()).abs() < 1e-12);
    }
}
