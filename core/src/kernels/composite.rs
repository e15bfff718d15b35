//! Interval weights, composited depth, opacity and features.
use super::shared::{FLAG_DENSE, FLAG_MAP, FLAG_POSE, Grid, interval_alpha, phi};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::{FieldParams, RAY_STATE_FLOATS, STATE_APPEARANCE, STATE_DEPTH, STATE_SEMANTIC};

kernel! { pub static COMPOSITE = mte_slam_shaders::kernels::composite, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        rays,
        depths,
        distances,
        planes_appearance: appearance_planes,
        planes_semantic: semantic_planes,
        weights,
        ray_state,
    } = dispatch.views();
    let grid = Grid::surface(&p);
    let n = p.samples as usize;
    dispatch.for_each_invocation(|id| {
        if id >= p.rays as usize {
            return;
        }
        let ray = rays[id];
        let base = id * n;
        let (mut appearance, mut semantic) = ([0.0_f32; 32], [0.0_f32; 32]);
        let (mut transmittance, mut depth, mut opacity) = (1.0, 0.0, 0.0);
        let (mut first, mut last) = (n, 0);
        let mut phi0 = phi(p.sharpness, distances[base]);
        for i in 1..n {
            let phi1 = phi(p.sharpness, distances[base + i]);
            let alpha = interval_alpha(phi0, phi1);
            let w = transmittance * alpha;
            transmittance *= 1.0 - alpha;
            let z = 0.5 * (depths[base + i - 1] + depths[base + i]);
            store_f32(&weights[base + i - 1], w);
            depth += w * z;
            opacity += w;
            if w > p.min_weight {
                first = first.min(i - 1);
                last = i;
                let at = ray.at(z);
                let f = grid.lookup(appearance_planes, at);
                for k in 0..32 {
                    appearance[k] += w * f[k];
                }
                if p.classes > 0 {
                    let f = grid.lookup(semantic_planes, at);
                    for k in 0..32 {
                        semantic[k] += w * f[k];
                    }
                }
            }
            phi0 = phi1;
        }
        store_f32(&weights[base + n - 1], 0.0);
        // Views show the depth that half of the light reaches: a mean over the edge of a surface
        // would lie in the air between it and what is behind.
        if p.flags & (FLAG_DENSE | FLAG_MAP | FLAG_POSE) == FLAG_DENSE {
            let (mut before, mut i) = (0.0, 1);
            let mut w = load_f32(&weights[base]);
            while i + 1 < n && before + w < 0.5 * opacity {
                before += w;
                w = load_f32(&weights[base + i]);
                i += 1;
            }
            let t = ((0.5 * opacity - before) / w.max(1e-12)).clamp(0.0, 1.0);
            let (z0, z1) = (depths[base + i - 1], depths[base + i]);
            depth = opacity * (z0 + t * (z1 - z0));
        }
        let state = &ray_state[id * RAY_STATE_FLOATS..(id + 1) * RAY_STATE_FLOATS];
        for k in 0..32 {
            store_f32(&state[STATE_APPEARANCE as usize * 4 + k], appearance[k]);
            store_f32(&state[STATE_SEMANTIC as usize * 4 + k], semantic[k]);
        }
        let range = (first.min(last) * 256 + last) as f32;
        for (k, v) in [depth, opacity, 0.0, range].into_iter().enumerate() {
            store_f32(&state[STATE_DEPTH as usize * 4 + k], v);
        }
    });
}
