//! Semantic plane features of a ray's samples.
use super::shared::Grid;
use crate::kernel::{CpuDispatch, store_f32};
use crate::layout::FieldParams;

kernel! { pub static SAMPLE_FEATURES = mte_slam_shaders::kernels::sample_features, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        rays,
        depths,
        weights,
        planes_semantic: planes,
        features,
        slot_depths,
        slot_weights,
    } = dispatch.views();
    let grid = Grid::surface(&p);
    let (n, slots) = (p.samples as usize, p.slots as usize);
    dispatch.for_each_invocation(|job| {
        if job >= p.rays as usize * slots {
            return;
        }
        let (id, slot) = (job / slots, job % slots);
        let weights = &weights[id * n..(id + 1) * n];
        let i = if slots < n {
            (0..n).filter(|i| weights[*i] > p.min_weight).nth(slot)
        } else {
            Some(slot)
        };
        let (mut z, mut weight, mut f) = (0.0, 0.0, [0.0; 32]);
        if let Some(i) = i {
            weight = weights[i];
            z = 0.5 * (depths[id * n + i] + depths[id * n + (i + 1).min(n - 1)]);
            f = grid.lookup(planes, rays[id].at(z));
        }
        store_f32(&slot_depths[job], z);
        store_f32(&slot_weights[job], weight);
        for (cell, f) in features[job * 32..(job + 1) * 32].iter().zip(f) {
            store_f32(cell, f);
        }
    });
}
