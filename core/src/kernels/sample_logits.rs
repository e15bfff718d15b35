//! Class logits of a ray's samples: composited, their loss, its gradients.
use super::shared::Ray;
use super::{CpuDispatch, load_f32, store_f32, store_u32};
use crate::layout::RAY_OUT_FLOATS;
use alloc::vec;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

params! {
    /// Parameters of [`SAMPLE_LOGITS`].
    pub struct SampleLogitsParams {
        /// Rays of this part of the batch.
        rays: u32,
        /// The first of them.
        first_ray: u32,
        /// Rays of the whole batch.
        batch_rays: u32,
        /// Slots of samples a ray.
        slots: u32,
        /// Classes.
        classes: u32,
        /// 1: write the gradients.
        train: u32,
        /// Weight of the cross-entropy.
        weight_semantic: f32,
    }
}

kernel! {
    /// Composites logits (the weights are constants), scores them, and puts their gradients in
    /// their place.
    pub static SAMPLE_LOGITS = "sample_logits" {
        workgroup_size: 64,
        params: SampleLogitsParams,
        twin: twin,
        bindings: [
            rays: Read,
            slot_weights: Read,
            class_weights: Read,
            logits: ReadWrite,
            ray_out: ReadWrite,
        ],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: SampleLogitsParams = dispatch.params();
    let (rays, weights) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let class_weights = dispatch.read_f32(2);
    let (logits, ray_out) = (dispatch.write(3), dispatch.write(4));
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
        let ray = Ray::load(rays, id);
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
