//! One pose from one or several references: damped Gauss-Newton over the levels.
use super::{
    OdometryError,
    config::AlignConfig,
    linear::{Mat6, congruence, solve_constrained},
    pyramid::RgbdPyramid,
    residuals::{Model, Sums, evaluate},
};
use alloc::vec::Vec;
use glam::DMat3;
use mte_slam_types::pose::Pose;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// An image whose pose is taken as known.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// Its images.
    pub pyramid: &'a RgbdPyramid,
    /// Its pose.
    pub world_from_camera: Pose,
    /// Weight of its residuals (1: as measured).
    pub weight: f64,
}

/// Result of an alignment.
#[derive(Clone, Debug)]
pub struct Alignment {
    /// `reference_from_current` for [`align`], `world_from_camera` for [`align_many`].
    pub pose: Pose,
    /// Normal matrix of the twist of [`Pose::retract`] \[1/m^2, 1/m, 1\]: an inverse covariance if
    /// residuals were independent; they are not, so use it for relative weight.
    pub information: [[f64; 6]; 6],
    /// Points whose point-to-plane distance is within three robust standard deviations, summed
    /// over the references.
    pub inliers: usize,
    /// Inliers as a share of the points that fall into the best reference's image.
    pub inlier_ratio: f64,
    /// Inliers as a share of all usable points, for the reference where that is largest.
    pub overlap: f64,
    /// The same for each reference.
    pub overlaps: Vec<f64>,
    /// Root mean square point-to-plane distance of inliers \[m\].
    pub geometric_rmse_m: f64,
    /// Root mean square intensity difference of inliers (0..1).
    pub photometric_rmse: f64,
    /// Mean robust cost a point in view with scales that do not depend on the residuals: compares
    /// alignments of the same images.
    pub score: f64,
    /// Whether the last level ended by small steps.
    pub converged: bool,
    /// Eigenvalues of the information, ascending, rotation scaled by the median depth \[1/m^2\].
    pub eigenvalues: [f64; 6],
    /// Number of directions the images do not constrain; they keep their initial value.
    pub unconstrained: usize,
}

impl Alignment {
    /// Returns the smallest over largest eigenvalue, 0 for no information at all.
    pub fn conditioning(&self) -> f64 {
        if self.eigenvalues[5] > 0.0 {
            (self.eigenvalues[0] / self.eigenvalues[5]).max(0.0)
        } else {
            0.0
        }
    }
}

/// Aligns `current` to one reference, starting from `initial` (`reference_from_current`).
///
/// # Errors
/// [`OdometryError::NoDepth`] where either frame has next to no depth, [`OdometryError::BadPose`].
pub fn align(
    reference: &RgbdPyramid,
    current: &RgbdPyramid,
    initial: &Pose,
    config: &AlignConfig,
) -> Result<Alignment, OdometryError> {
    let reference =
        Reference { pyramid: reference, world_from_camera: Pose::IDENTITY, weight: 1.0 };
    align_many(&[reference], current, initial, config)
}

/// Aligns `current` to all `references` at once: one pose (`world_from_camera`), the sum of their
/// normal equations.
///
/// # Errors
/// As [`align`], and [`OdometryError::NoReference`].
pub fn align_many(
    references: &[Reference<'_>],
    current: &RgbdPyramid,
    initial: &Pose,
    config: &AlignConfig,
) -> Result<Alignment, OdometryError> {
    align_levels(references, current, initial, config, usize::MAX, 0)
}

/// Exposure and noise of one reference, estimated along the way.
#[derive(Clone, Copy)]
struct State {
    gain: f64,
    bias: f64,
    geometric_scale: f32,
    photometric_sigma: f32,
}

struct Normal {
    h: Mat6,
    b: [f64; 6],
    cost: f64,
    /// Per reference: exposure step as a function of the reference-frame twist.
    exposure: Vec<[[f64; 7]; 2]>,
    sums: Vec<Sums>,
}

/// The same from level `coarsest` (or the coarsest there is) down to `finest`.
pub(super) fn align_levels(
    references: &[Reference<'_>],
    current: &RgbdPyramid,
    initial: &Pose,
    config: &AlignConfig,
    coarsest: usize,
    finest: usize,
) -> Result<Alignment, OdometryError> {
    current.check()?;
    if references.is_empty() {
        return Err(OdometryError::NoReference { frame: current.frame });
    }
    for r in references {
        r.pyramid.check()?;
        if !r.world_from_camera.is_finite() {
            return Err(OdometryError::BadPose { frame: r.pyramid.frame });
        }
    }
    if !initial.is_finite() {
        return Err(OdometryError::BadPose { frame: current.frame });
    }
    let top = references
        .iter()
        .map(|r| r.pyramid.levels.len())
        .min()
        .unwrap_or(1)
        .min(current.levels.len())
        - 1;
    let lever = current.median_depth_m.max(0.2);
    let mut pose = *initial;
    let mut states: Vec<State> = references
        .iter()
        .map(|_| State { gain: 1.0, bias: 0.0, geometric_scale: 5.0, photometric_sigma: 0.05 })
        .collect();
    let mut last = None;
    let mut converged = false;
    let mut spectrum = ([0.0; 6], 6);
    for level in (finest.min(top)..=coarsest.min(top)).rev() {
        let mut normal = build(references, current, &pose, config, level, &states);
        rescale(&mut states, &normal.sums, config);
        if last.is_none() {
            normal = build(references, current, &pose, config, level, &states);
        }
        let mut lambda = 0.0;
        converged = false;
        for _ in 0..config.iterations[level.min(3)] {
            let (step, values, left_out) =
                solve_constrained(&normal.h, &normal.b, lambda, lever, config.degenerate_ratio);
            spectrum = (values, left_out);
            let size = (0..3).map(|i| step[i].abs()).fold(0.0, f64::max)
                + lever * (3..6).map(|i| step[i].abs()).fold(0.0, f64::max);
            if !size.is_finite() {
                break;
            }
            // A step across the image is no linearisation any more.
            let limit = (0.5 * lever / size).min(1.0);
            let step = step.map(|x| x * limit);
            let tried = pose.retract(&step);
            let mut tried_states = states.clone();
            for (k, state) in tried_states.iter_mut().enumerate() {
                update_exposure(state, &references[k], &normal.exposure[k], &step);
            }
            let next = build(references, current, &tried, config, level, &tried_states);
            let small = size < config.convergence * lever * (1 << level) as f64;
            if next.cost <= normal.cost * (1.0 + 1e-6) || !normal.cost.is_finite() {
                pose = tried;
                states = tried_states;
                rescale(&mut states, &next.sums, config);
                normal = next;
                lambda *= 0.1;
                if small {
                    converged = true;
                    break;
                }
            } else {
                if small {
                    converged = true;
                    break;
                }
                lambda = (lambda * 10.0).max(0.3);
            }
        }
        last = Some(normal);
    }
    let normal = match last {
        Some(n) => n,
        None => build(references, current, &pose, config, finest, &states),
    };
    let mut result = Alignment {
        pose,
        information: normal.h,
        inliers: 0,
        inlier_ratio: 0.0,
        overlap: 0.0,
        overlaps: Vec::with_capacity(references.len()),
        geometric_rmse_m: 0.0,
        photometric_rmse: 0.0,
        score: 0.0,
        converged,
        eigenvalues: spectrum.0,
        unconstrained: spectrum.1,
    };
    let (mut g, mut p) = ([0.0; 2], [0.0; 2]);
    for s in &normal.sums {
        result.inliers += s.inliers as usize;
        let overlap = f64::from(s.inliers) / f64::from(s.tried.max(1));
        result.overlaps.push(overlap);
        if overlap >= result.overlap {
            result.overlap = overlap;
            let share = f64::from(s.in_view) / f64::from(s.tried.max(1));
            // A handful of points that agree by accident is not agreement.
            let enough = (f64::from(s.in_view) / 200.0).min(1.0);
            result.inlier_ratio = enough * f64::from(s.inliers) / f64::from(s.in_view.max(1));
            // The square root leans towards the pose that sees more, not fully.
            result.score =
                s.fixed_cost / f64::from(s.in_view.max(1)) / share.max(0.05).sqrt().max(0.3);
        }
        for i in 0..2 {
            g[i] += s.geometric_square[i];
            p[i] += s.photometric_square[i];
        }
    }
    result.geometric_rmse_m = (g[0] / g[1].max(1.0)).sqrt();
    result.photometric_rmse = (p[0] / p[1].max(1.0)).sqrt();
    Ok(result)
}

/// One point in this many is used; never a divisor of the row, which would pick columns.
fn stride(points: usize, most: usize, width: usize) -> usize {
    let mut s = points.div_ceil(most.max(1)).max(1);
    while s > 1 && width.is_multiple_of(s) {
        s += 1;
    }
    s
}

fn rescale(states: &mut [State], sums: &[Sums], config: &AlignConfig) {
    for (state, sums) in states.iter_mut().zip(sums) {
        if let Some(x) = sums.geometric_mad() {
            state.geometric_scale = x.max(config.min_geometric_scale as f32);
        }
        if let Some(x) = sums.photometric_mad() {
            state.photometric_sigma = x.max(config.min_photometric_sigma as f32);
        }
    }
}

fn rows(r: &DMat3) -> [[f64; 3]; 3] {
    let t = r.transpose();
    [t.x_axis.to_array(), t.y_axis.to_array(), t.z_axis.to_array()]
}

fn build(
    references: &[Reference<'_>],
    current: &RgbdPyramid,
    pose: &Pose,
    config: &AlignConfig,
    level: usize,
    states: &[State],
) -> Normal {
    let points = &current.levels[level].points;
    let mut out = Normal {
        h: [[0.0; 6]; 6],
        b: [0.0; 6],
        cost: 0.0,
        exposure: Vec::with_capacity(references.len()),
        sums: Vec::with_capacity(references.len()),
    };
    let mut in_view = 0.0;
    for (reference, state) in references.iter().zip(states) {
        let from_world = reference.world_from_camera.inverse();
        let relative = from_world.compose(pose);
        let model = Model {
            r: rows(&relative.rotation).map(|row| row.map(|x| x as f32)),
            t: relative.translation.to_array().map(|x| x as f32),
            gain: state.gain as f32,
            bias: state.bias as f32,
            geometric_scale: state.geometric_scale,
            photometric_sigma: state.photometric_sigma,
            photometric_weight: config.photometric_weight as f32,
            geometric_weight: config.geometric_weight as f32,
            kernel_width: config.kernel_width as f32,
            gate: (config.depth_gate as f32 * (1 << level.min(8)) as f32)
                .min(config.max_gate as f32),
            normal_cos: config.normal_cos as f32,
            pixel_noise: config.pixel_noise as f32,
            noise: current.noise,
            stride: stride(points.len(), config.max_points as usize, current.levels[level].width),
        };
        let sums = evaluate(&reference.pyramid.levels[level], points, &model);
        // Exposure is eliminated (Schur complement); a weak prior keeps it near (1, 0).
        let mut e = [[sums.h[6][6], sums.h[6][7]], [sums.h[7][6], sums.h[7][7]]];
        let prior = 1e-2 * f64::from(sums.photometric) + 1.0;
        e[0][0] += prior / 0.04;
        e[1][1] += prior / 0.01;
        let be =
            [sums.b[6] + prior / 0.04 * (state.gain - 1.0), sums.b[7] + prior / 0.01 * state.bias];
        let det = e[0][0] * e[1][1] - e[0][1] * e[1][0];
        let inverse = [[e[1][1] / det, -e[0][1] / det], [-e[1][0] / det, e[0][0] / det]];
        // exposure step = -inverse (be + cross step): columns 0..6 for the step, 6 constant.
        let mut law = [[0.0; 7]; 2];
        for i in 0..2 {
            for j in 0..6 {
                law[i][j] = -(inverse[i][0] * sums.h[6][j] + inverse[i][1] * sums.h[7][j]);
            }
            law[i][6] = -(inverse[i][0] * be[0] + inverse[i][1] * be[1]);
        }
        let mut h = [[0.0; 6]; 6];
        let mut b = [0.0; 6];
        for i in 0..6 {
            for j in 0..6 {
                h[i][j] = sums.h[i][j] + sums.h[i][6] * law[0][j] + sums.h[i][7] * law[1][j];
            }
            b[i] = sums.b[i] + sums.h[i][6] * law[0][6] + sums.h[i][7] * law[1][6];
        }
        let r = rows(&from_world.rotation);
        let world = congruence(&h, &r);
        for i in 0..6 {
            for j in 0..6 {
                out.h[i][j] += reference.weight * world[i][j];
            }
            let block = i / 3 * 3;
            out.b[i] +=
                reference.weight * (0..3).map(|k| r[k][i - block] * b[block + k]).sum::<f64>();
        }
        out.cost += reference.weight * sums.cost;
        in_view += reference.weight * f64::from(sums.in_view);
        out.exposure.push(law);
        out.sums.push(sums);
    }
    out.cost = if in_view > 0.0 { out.cost / in_view } else { f64::INFINITY };
    out
}

fn update_exposure(
    state: &mut State,
    reference: &Reference<'_>,
    law: &[[f64; 7]; 2],
    step: &[f64; 6],
) {
    let r = rows(&reference.world_from_camera.rotation.transpose());
    let mut delta = [law[0][6], law[1][6]];
    for (d, law) in delta.iter_mut().zip(law) {
        for i in 0..6 {
            let block = i / 3 * 3;
            let local: f64 = (0..3).map(|k| r[i - block][k] * step[block + k]).sum();
            *d += law[i] * local;
        }
    }
    state.gain = (state.gain + delta[0]).clamp(0.4, 2.5);
    state.bias = (state.bias + delta[1]).clamp(-0.5, 0.5);
}
