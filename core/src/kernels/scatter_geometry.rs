//! Adds feature gradients into the geometry planes, fixed point.
use super::adam::STATUS_SATURATED;
use super::shared::{Grid, plane_corners};
use crate::kernel::{CpuDispatch, add_i32, or_u32};
use crate::layout::FieldParams;
use core::sync::atomic::AtomicU32;

kernel! { pub static SCATTER_GEOMETRY = mte_slam_shaders::kernels::scatter_geometry, twin }

/// Adds `values * scale` as quanta, clamped to `limit` (and reported) each.
pub(super) fn add_quanta(
    gradient: &[AtomicU32],
    status: &[AtomicU32],
    first: usize,
    values: &[f32],
    scale: f32,
    limit: f32,
) {
    for (k, v) in values.iter().enumerate() {
        let scaled = v * scale;
        let limited = scaled.clamp(-limit, limit);
        if limited != scaled {
            or_u32(&status[0], STATUS_SATURATED);
        }
        // Halves to even, as WGSL's round: exact below 2^22, which `limit` stays under.
        const MAGIC: f32 = 12_582_912.0;
        let quanta = ((limited + MAGIC) - MAGIC) as i32;
        if quanta != 0 {
            add_i32(&gradient[first + k], quanta);
        }
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { rays: ray_words, depths, distance_gradient: ds, features, gradient, status } =
        dispatch.views();
    let grid = Grid::geometry(&p);
    let n = p.samples as usize;
    dispatch.for_each_invocation(|job| {
        if job >= p.rays as usize * 24 {
            return;
        }
        let rays = p.rays as usize;
        let (quad, id, part) = (job % 4, (job / 4) % rays, job / (4 * rays));
        let (plane, level) = (part % 3, part / 3);
        let ray = ray_words[id];
        let mut held = [usize::MAX; 4];
        let mut sums = [[0.0_f32; 4]; 4];
        let flush = |held: [usize; 4], sums: &[[f32; 4]; 4]| {
            if held[0] != usize::MAX {
                for c in 0..4 {
                    let first = held[c] * 16 + quad * 4;
                    let (scale, limit) = (p.scale_geometry, p.contribution_limit);
                    add_quanta(gradient, status, first, &sums[c], scale, limit);
                }
            }
        };
        for i in 0..n {
            if ds[id * n + i] == 0.0 {
                continue;
            }
            let v = &features[(id * n + i) * 32 + level * 16 + quad * 4..][..4];
            let g = grid.local(ray.at(depths[id * n + i]), level);
            let c = plane_corners(plane, g, grid.levels[level]);
            if c.cell[0] != held[0] {
                flush(held, &sums);
                held = c.cell;
                sums = [[0.0; 4]; 4];
            }
            for corner in 0..4 {
                for k in 0..4 {
                    sums[corner][k] += c.weight[corner] * v[k];
                }
            }
        }
        flush(held, &sums);
    });
}
