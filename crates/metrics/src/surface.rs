//! Accuracy and completion of a mesh against a true one, by samples of both surfaces.
use super::{
    MetricsError,
    bvh::{NearestBvh, Shape, triangles},
    trajectory::align_rigid,
};
use alloc::{format, string::String, vec::Vec};
use glam::DVec3;
use mte_slam_mesh::{Mesh, to_dvec3};
use mte_slam_types::{
    maths::{Random, pcg},
    parallel,
    pose::Pose,
};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;
use serde::Serialize;

/// How meshes are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceOptions {
    /// Samples per mesh.
    pub samples: usize,
    /// Seed of the samples.
    pub seed: u32,
    /// Distance under which a point counts as found \[m\].
    pub threshold_m: f64,
}

impl Default for SurfaceOptions {
    /// 200,000 samples and 5 cm, as the peers use.
    fn default() -> Self {
        SurfaceOptions { samples: 200_000, seed: 0, threshold_m: 0.05 }
    }
}

/// Figures of one kind of distance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceFigures {
    /// Mean distance from the estimate's samples to the truth \[cm\].
    pub accuracy_cm: f64,
    /// Mean distance from the truth's samples to the estimate \[cm\].
    pub completion_cm: f64,
    /// Share of the estimate's samples nearer to the truth than the threshold \[%\].
    pub accuracy_ratio_percent: f64,
    /// Share of the truth's samples nearer to the estimate than the threshold \[%\].
    pub completion_ratio_percent: f64,
    /// Harmonic mean of the two ratios \[%\].
    pub f_score_percent: f64,
}

/// Comparison of two meshes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]); the caller names how the meshes were
    /// culled and aligned.
    pub protocol_id: String,
    /// What the figures mean; the caller adds how the meshes were culled and aligned.
    pub protocol: String,
    /// Samples per mesh.
    pub samples: usize,
    /// Seed of the samples.
    pub seed: u32,
    /// Threshold of the ratios \[cm\].
    pub threshold_cm: f64,
    /// Area of the estimate \[m2\].
    pub estimated_area_m2: f64,
    /// Area of the truth \[m2\].
    pub true_area_m2: f64,
    /// Distances between the samples of the two meshes: the peers' figures.
    pub point_to_point: SurfaceFigures,
    /// Exact distances from samples to the other mesh's triangles.
    pub point_to_surface: SurfaceFigures,
    /// What `point_to_point` cannot go below: the mean distance between two samplings of the
    /// truth \[cm\].
    pub sampling_floor_cm: f64,
}

/// Points on the surface, uniform by area. Sample i depends on the seed, the stream and i alone.
///
/// # Errors
/// [`MetricsError::NoSurface`] for a broken mesh, or one without a finite, positive area; `which`
/// names the mesh in it.
pub fn sample_surface(
    mesh: &Mesh,
    samples: usize,
    seed: u32,
    stream: u32,
    which: &'static str,
) -> Result<Vec<[f32; 3]>, MetricsError> {
    let no_surface = |found: String| MetricsError::NoSurface { mesh: which, found };
    mesh.check().map_err(|e| no_surface(format!("{e}")))?;
    let mut total = 0.0;
    let areas = (0..mesh.triangles.len()).map(|t| {
        total += mesh.triangle_area(t);
        total
    });
    let cumulative: Vec<f64> = areas.collect();
    if !(total.is_finite() && total > 0.0) {
        return Err(no_surface(format!("{} triangles of {total} m2", cumulative.len())));
    }
    Ok(parallel::map(samples, |i| {
        // A stream of its own for each sample.
        let mut rng = Random::new(seed, pcg(stream) ^ pcg(i as u32));
        let target = rng.uniform() * total;
        let t = cumulative.partition_point(|&c| c <= target).min(cumulative.len() - 1);
        let (root, along) = (rng.uniform().sqrt(), rng.uniform());
        let [a, b, c] = mesh.corners(t);
        let p = a * (1.0 - root) + b * (root * (1.0 - along)) + c * (root * along);
        p.to_array().map(|x| x as f32)
    }))
}

/// Returns the distance from each point to the nearest shape \[m\].
fn distances<S: Shape>(points: &[[f32; 3]], to: &NearestBvh<S>) -> Vec<f64> {
    parallel::map(points.len(), |i| {
        to.nearest(to_dvec3(points[i]), f64::INFINITY).map_or(f64::NAN, |(_, d)| d.sqrt())
    })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn figures(accuracy: &[f64], completion: &[f64], threshold_m: f64) -> SurfaceFigures {
    let ratio =
        |d: &[f64]| 100.0 * d.iter().filter(|&&d| d < threshold_m).count() as f64 / d.len() as f64;
    let (precision, recall) = (ratio(accuracy), ratio(completion));
    let sum = precision + recall;
    SurfaceFigures {
        accuracy_cm: mean(accuracy) * 100.0,
        completion_cm: mean(completion) * 100.0,
        accuracy_ratio_percent: precision,
        completion_ratio_percent: recall,
        f_score_percent: if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 },
    }
}

/// Compares two meshes in one frame, both already culled alike
/// ([`mte_slam_mesh::observed_part`]).
///
/// # Errors
/// [`MetricsError::NoSurface`] when samples cannot be drawn from a mesh;
/// [`MetricsError::Size`] for 0 samples.
pub fn evaluate_surface(
    estimate: &Mesh,
    truth: &Mesh,
    options: &SurfaceOptions,
) -> Result<SurfaceReport, MetricsError> {
    let SurfaceOptions { samples, seed, threshold_m } = *options;
    if samples == 0 {
        return Err(MetricsError::Size { what: "samples per mesh", found: 0, expected: 1 });
    }
    let of_estimate = sample_surface(estimate, samples, seed, 0, "estimated")?;
    let of_truth = sample_surface(truth, samples, seed, 1, "true")?;
    let again = sample_surface(truth, samples, seed, 2, "true")?;
    let (estimate_points, truth_points) =
        (NearestBvh::new(&of_estimate), NearestBvh::new(&of_truth));
    // Neighbouring queries visit the same nodes: points in the order of their own tree are twice
    // as fast to look up.
    let point_to_point = figures(
        &distances(estimate_points.shapes(), &truth_points),
        &distances(truth_points.shapes(), &estimate_points),
        threshold_m,
    );
    let sampling_floor_cm = 100.0 * mean(&distances(&again, &truth_points));
    let accuracy = distances(estimate_points.shapes(), &NearestBvh::of(triangles(truth)));
    let completion = distances(truth_points.shapes(), &NearestBvh::of(triangles(estimate)));
    Ok(SurfaceReport {
        protocol_id: crate::protocol::SURFACE.into(),
        protocol: format!(
            "mesh: {samples} area-weighted samples per mesh, ratio under {} cm",
            threshold_m * 100.0
        ),
        samples,
        seed,
        threshold_cm: threshold_m * 100.0,
        estimated_area_m2: estimate.area(),
        true_area_m2: truth.area(),
        point_to_point,
        point_to_surface: figures(&accuracy, &completion, threshold_m),
        sampling_floor_cm,
    })
}

/// Point-to-point ICP from the estimate to the truth, as the peers run before they compare:
/// pairs closer than `max_distance_m` (0.1), until the motion of a step is below 1e-6 or 50
/// steps. Returns the pose that maps the estimate onto the truth.
///
/// # Errors
/// A mesh without surface, or fewer than 3 pairs.
pub fn icp(
    estimate: &Mesh,
    truth: &Mesh,
    max_distance_m: f64,
    seed: u32,
) -> Result<Pose, MetricsError> {
    let of_estimate = sample_surface(estimate, 20_000, seed, 3, "estimated")?;
    let of_truth = sample_surface(truth, 200_000, seed, 4, "true")?;
    let target = NearestBvh::new(&of_truth);
    let mut pose = Pose::IDENTITY;
    for _ in 0..50 {
        let pairs: Vec<Option<(DVec3, DVec3)>> = parallel::map(of_estimate.len(), |i| {
            let p = pose.transform_point(to_dvec3(of_estimate[i]));
            let (nearest, _) = target.nearest(p, max_distance_m)?;
            Some((p, to_dvec3(of_truth[nearest as usize])))
        });
        let (from, to): (Vec<_>, Vec<_>) = pairs.into_iter().flatten().unzip();
        let step = align_rigid(&from, &to).map_err(MetricsError::Alignment)?.target_from_source;
        pose = step.compose(&pose).orthonormalised();
        if step.translation.length() < 1e-6 && step.angle_rad() < 1e-6 {
            break;
        }
    }
    Ok(pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;

    fn options(samples: usize) -> SurfaceOptions {
        SurfaceOptions { samples, ..SurfaceOptions::default() }
    }

    #[test]
    fn samples_are_uniform_by_area() {
        // One triangle of a square cut into very many: half of the area is still half.
        let mut mesh = square(1, 1.0, 0.0);
        mesh.triangles.remove(0);
        let fine = square(40, 1.0, 0.0);
        let offset = mesh.positions.len() as u32;
        mesh.positions.extend(fine.positions.iter().map(|p| [p[0], p[1], 1.0]));
        mesh.triangles.extend(fine.triangles.iter().map(|t| t.map(|i| i + offset)));
        let points = sample_surface(&mesh, 30_000, 7, 0, "true").unwrap();
        let low = points.iter().filter(|p| p[2] == 0.0).count() as f64 / 30_000.0;
        assert!((low - 1.0 / 3.0).abs() < 0.01, "{low}");
        let x = points.iter().filter(|p| p[2] == 1.0).map(|p| f64::from(p[0]));
        let (n, sum) = x.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
        assert!((sum / n - 0.5f64).abs() < 0.01);
        assert_eq!(points, sample_surface(&mesh, 30_000, 7, 0, "true").unwrap());
        assert_ne!(points, sample_surface(&mesh, 30_000, 8, 0, "true").unwrap());
        // More samples only add to the list.
        assert_eq!(points[..10], sample_surface(&mesh, 10, 7, 0, "true").unwrap());
    }

    #[test]
    fn offset_planes_have_the_offset_as_error() {
        let (truth, estimate) = (square(5, 2.0, 0.0), square(7, 2.0, 0.03));
        let r = evaluate_surface(&estimate, &truth, &options(20_000)).unwrap();
        let exact = &r.point_to_surface;
        assert!((exact.accuracy_cm - 3.0).abs() < 1e-4 && (exact.completion_cm - 3.0).abs() < 1e-4);
        assert_eq!((exact.completion_ratio_percent, exact.f_score_percent), (100.0, 100.0));
        assert!((r.true_area_m2 - 4.0).abs() < 1e-6);
        // Mean distance to the nearest of n random points on an area A: 0.5 sqrt(A / n).
        assert!((r.sampling_floor_cm - 50.0 * (4.0f64 / 20_000.0).sqrt()).abs() < 0.02);
        assert!(r.point_to_point.accuracy_cm > 3.0);
    }

    #[test]
    fn missing_parts_cost_completion_only() {
        let truth = square(20, 2.0, 0.0);
        let mut estimate = truth.clone();
        let xs: Vec<f64> = (0..800).map(|t| truth.corners(t).map(|p| p.x).iter().sum()).collect();
        estimate.retain_triangles(|t| xs[t] < 3.0); // the left half
        let r = evaluate_surface(&estimate, &truth, &options(20_000)).unwrap().point_to_surface;
        assert!(r.accuracy_cm < 1e-4 && r.accuracy_ratio_percent == 100.0);
        assert!((r.completion_cm - 25.0).abs() < 1.0);
        assert!((r.completion_ratio_percent - 52.5).abs() < 1.5);
    }

    #[test]
    fn meshes_without_surface_are_refused() {
        let good = square(2, 1.0, 0.0);
        let mut flat = good.clone();
        flat.positions.iter_mut().for_each(|p| p[1] = 0.0);
        let mut broken = good.clone();
        broken.triangles[0][0] = 99;
        let mut nan = good.clone();
        nan.positions[0][0] = f32::NAN;
        for bad in [Mesh::default(), flat, broken, nan] {
            let e = evaluate_surface(&good, &bad, &options(10)).unwrap_err();
            assert!(matches!(e, MetricsError::NoSurface { mesh: "true", .. }), "{e}");
        }
        assert!(evaluate_surface(&good, &good, &options(0)).is_err());
    }

    #[test]
    fn icp_finds_a_small_motion() {
        // Three walls of a corner.
        let mut truth = square(4, 1.0, 0.0);
        for k in 1..3 {
            let wall = square(4, 1.0, 0.0);
            let offset = truth.positions.len() as u32;
            let turn = |p: &[f32; 3]| core::array::from_fn(|a| p[(a + k) % 3]);
            truth.positions.extend(wall.positions.iter().map(turn));
            truth.triangles.extend(wall.triangles.iter().map(|t| t.map(|i| i + offset)));
        }
        let moved = Pose::from_twist(&[0.01, -0.015, 0.02, 0.01, 0.0, -0.01]);
        let mut estimate = truth.clone();
        estimate.transform(&moved.inverse());
        let found = icp(&estimate, &truth, 0.1, 1).unwrap();
        let rest = found.compose(&moved.inverse());
        assert!(rest.translation.length() < 1e-3 && rest.angle_rad() < 1e-3, "{rest:?}");
        estimate.transform(&Pose { translation: DVec3::splat(9.0), ..Pose::IDENTITY });
        assert!(matches!(icp(&estimate, &truth, 0.1, 1), Err(MetricsError::Alignment(_))));
    }
}
