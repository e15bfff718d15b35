//! Semantic plane features of a ray's samples.
use super::shared::{Grid, Ray};
use super::{CpuDispatch, store_f32};
use crate::layout::FieldParams;

kernel! {
    /// Features, depth and weight of every slot of a ray: all intervals, or in views the first ones
    /// that carry weight.
    pub static SAMPLE_FEATURES = "sample_features" {
        workgroup_size: 64,
        params: FieldParams,
        twin: twin,
        bindings: [
            rays: Read,
            depths: Read,
            weights: Read,
            planes_semantic: Read,
            features: ReadWrite,
            slot_depths: ReadWrite,
            slot_weights: ReadWrite,
        ],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let (rays, depths) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let (weights, planes) = (dispatch.read_f32(2), dispatch.read_f32(3));
    let (features, slot_depths) = (dispatch.write(4), dispatch.write(5));
    let slot_weights = dispatch.write(6);
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
            f = grid.lookup(planes, Ray::load(rays, id).at(z));
        }
        store_f32(&slot_depths[job], z);
        store_f32(&slot_weights[job], weight);
        for (cell, f) in features[job * 32..(job + 1) * 32].iter().zip(f) {
            store_f32(cell, f);
        }
    });
}
