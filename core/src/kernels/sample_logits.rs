//! Class logits of a ray's samples: composited, their loss, its gradients.
pub use mte_slam_shaders::kernels::sample_logits::SampleLogitsParams;

use crate::kernel::{CpuDispatch, load_f32, store_f32, store_u32};
use crate::layout::RAY_OUT_FLOATS;
use alloc::vec;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

kernel! { pub static SAMPLE_LOGITS = mte_slam_shaders::kernels::sample_logits, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: SampleLogitsParams = dispatch.params();
    let Views { rays, slot_weights: weights, class_weights, logits, ray_out } = dispatch.views();
    let (slots, classes) = (p.slots as usize, p.classes as usize);
    dispatch.for_each_workgroup(|group| {
        if group >= p.rays {
            return;
        }
        let id = (p.first_ray + group) as usize;
        let weights = &weights[id * slots..(id + 1) * slots];
        let at = group as usize * slots * classes;
        let logits = &logits[at..at + slots * classes];
        let mut composited = vec![0.0_f32; classes];
        for (w, row) in weights.iter().zip(logits.chunks_exact(classes)) {
            for (sum, x) in composited.iter_mut().zip(row) {
                *sum += w * load_f32(x);
            }
        }
        let (mut best_logit, mut best_class) = (-1e30_f32, 255);
        let (mut best, mut sum) = (-1e30_f32, 0.0_f32);
        for (c, v) in composited.iter_mut().enumerate() {
            if *v > best_logit {
                (best_logit, best_class) = (*v, c as u32);
            }
            *v += class_weights[2 * c + 1];
            if *v > best {
                sum = sum * (best - *v).exp() + 1.0;
                best = *v;
            } else {
                sum += (*v - best).exp();
            }
        }
        let ray = rays[id];
        let label = ray.class() as usize;
        let (mut loss, mut scale) = (0.0, 0.0);
        if label < classes && !ray.masked() {
            let weight = class_weights[2 * label];
            loss = weight * (sum.ln() + best - composited[label]);
            scale = weight * p.weight_semantic / p.batch_rays as f32;
        }
        store_u32(&ray_out[id * RAY_OUT_FLOATS + 5], best_class);
        store_f32(&ray_out[id * RAY_OUT_FLOATS + 8], loss);
        if p.train == 0 {
            return;
        }
        for (c, v) in composited.iter_mut().enumerate() {
            let target = if c == label { 1.0 } else { 0.0 };
            *v = scale * ((*v - best).exp() / sum - target);
        }
        for (w, row) in weights.iter().zip(logits.chunks_exact(classes)) {
            for (cell, g) in row.iter().zip(&composited) {
                store_f32(cell, w * g);
            }
        }
    });
}
