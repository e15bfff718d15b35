//! Adds feature gradients into the appearance and semantic planes, fixed point.
use super::scatter_geometry::add_quanta;
use super::shared::{Grid, plane_corners};
use crate::kernel::CpuDispatch;
use crate::layout::{
    FieldParams, RAY_STATE_FLOATS, STATE_APPEARANCE_GRADIENT, STATE_DEPTH, STATE_SEMANTIC_GRADIENT,
};

kernel! { pub static SCATTER_SURFACE = mte_slam_shaders::kernels::scatter_surface, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        rays: all_rays,
        depths,
        weights,
        ray_state,
        gradient_appearance,
        gradient_semantic,
        status,
    } = dispatch.views();
    let targets = [gradient_appearance, gradient_semantic];
    let grid = Grid::surface(&p);
    let n = p.samples as usize;
    dispatch.for_each_invocation(|job| {
        if job >= p.rays as usize * 48 {
            return;
        }
        let rays = p.rays as usize;
        let (quad, id, part) = (job % 4, (job / 4) % rays, job / (4 * rays));
        let (plane, level, modality) = (part % 3, (part / 3) % 2, part / 6);
        let ray = all_rays[id];
        let unlabelled =
            ray.class() >= p.classes && p.weight_compression == 0.0 && p.weight_feature == 0.0;
        let colorless = modality == 0 && p.weight_color == 0.0;
        if ray.masked() || colorless || (modality == 1 && unlabelled) {
            return;
        }
        let (scale, state) = if modality == 1 {
            (p.scale_semantic, STATE_SEMANTIC_GRADIENT)
        } else {
            (p.scale_appearance, STATE_APPEARANCE_GRADIENT)
        };
        let at = id * RAY_STATE_FLOATS + state as usize * 4 + level * 16 + quad * 4;
        let g: [f32; 4] = core::array::from_fn(|k| ray_state[at + k] * scale);
        let mut held = [usize::MAX; 4];
        let mut sums = [0.0_f32; 4];
        let flush = |held: [usize; 4], sums: &[f32; 4]| {
            if held[0] == usize::MAX {
                return;
            }
            for c in 0..4 {
                let (first, values) = (held[c] * 16 + quad * 4, g.map(|x| x * sums[c]));
                add_quanta(targets[modality], status, first, &values, 1.0, p.contribution_limit);
            }
        };
        let range = ray_state[id * RAY_STATE_FLOATS + STATE_DEPTH as usize * 4 + 3] as usize;
        for i in range / 256..range % 256 {
            let w = weights[id * n + i];
            if w <= p.min_weight {
                continue;
            }
            let z = 0.5 * (depths[id * n + i] + depths[id * n + i + 1]);
            let c = plane_corners(plane, grid.local(ray.at(z), level), grid.levels[level]);
            if c.cell[0] != held[0] {
                flush(held, &sums);
                held = c.cell;
                sums = [0.0; 4];
            }
            for corner in 0..4 {
                sums[corner] += c.weight[corner] * w;
            }
        }
        flush(held, &sums);
    });
}
