//! Anchors follow the features matched to them (paper eqs. 11, 12).
pub use mte_slam_shaders::kernels::update_anchors::UpdateAnchorsParams;

use crate::kernel::{CpuDispatch, load_f32, store_f32, store_u32};
use crate::layout::{ANCHOR_FLOATS, FEATURE, RAY_STATE_FLOATS, STATE_ANCHOR, STATE_FEATURE};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

kernel! { pub static UPDATE_ANCHORS = mte_slam_shaders::kernels::update_anchors, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: UpdateAnchorsParams = dispatch.params();
    let Views { rays: ray_words, ray_state, anchors, votes } = dispatch.views();
    let classes = p.classes as usize;
    dispatch.for_each_workgroup(|index| {
        let anchor = &anchors[index as usize * ANCHOR_FLOATS..(index as usize + 1) * ANCHOR_FLOATS];
        let votes = &votes[index as usize * classes..(index as usize + 1) * classes];
        if anchor[16].load(core::sync::atomic::Ordering::Relaxed) == 255 {
            return;
        }
        for v in votes {
            store_f32(v, load_f32(v) * p.decay);
        }
        let (mut sum, mut count) = ([0.0_f32; FEATURE], 0.0_f32);
        for ray in 0..p.rays as usize {
            let state = &ray_state[ray * RAY_STATE_FLOATS..];
            if state[STATE_ANCHOR as usize * 4].to_bits() != index {
                continue;
            }
            let ray = ray_words[ray];
            if ray.masked() {
                continue;
            }
            count += 1.0;
            for (k, s) in sum.iter_mut().enumerate() {
                *s += state[STATE_FEATURE as usize * 4 + k];
            }
            if ray.class() < p.classes {
                let v = &votes[ray.class() as usize];
                store_f32(v, load_f32(v) + 1.0);
            }
        }
        let matches = load_f32(&anchor[17]);
        let mut moved = 0.0_f32;
        if count > 0.0 {
            let rate = if p.rule == 1 {
                count / (matches + count)
            } else {
                1.0 - libm::powf(1.0 - p.beta, count)
            };
            for (cell, s) in anchor.iter().zip(sum) {
                let step = rate * (s / count - load_f32(cell));
                moved += step * step;
                store_f32(cell, load_f32(cell) + step);
            }
        }
        store_f32(&anchor[17], (matches + count).min(p.memory));
        store_f32(&anchor[18], load_f32(&anchor[18]) * p.decay + count);
        let variation = load_f32(&anchor[19]) * p.variation_decay;
        store_f32(&anchor[19], variation + (1.0 - p.variation_decay) * moved.sqrt());
        store_f32(&anchor[20], load_f32(&anchor[20]) + 1.0);
        let (mut best, mut class) = (0.0, anchor[16].load(core::sync::atomic::Ordering::Relaxed));
        for (c, v) in votes.iter().enumerate() {
            if load_f32(v) > best {
                (best, class) = (load_f32(v), c as u32);
            }
        }
        store_u32(&anchor[16], class);
    });
}
