//! Gradients at the signed distances: through the interval weights, and the distance losses.
use super::shared::{FLAG_POSE, Grid, cross, phi};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::{
    FieldParams, RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_APPEARANCE_GRADIENT, STATE_DEPTH,
    STATE_POSE,
};

kernel! { pub static COMPOSITE_BACKWARD = mte_slam_shaders::kernels::composite_backward, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        rays,
        depths,
        distances,
        weights,
        planes_appearance: planes,
        ray_state,
        ray_out,
        distance_gradient: gradient,
    } = dispatch.views();
    let grid = Grid::surface(&p);
    let n = p.samples as usize;
    let inv_rays = 1.0 / p.rays as f32;
    dispatch.for_each_invocation(|id| {
        if id >= p.rays as usize {
            return;
        }
        let ray = rays[id];
        let (z, s) = (&depths[id * n..(id + 1) * n], &distances[id * n..(id + 1) * n]);
        let w = &weights[id * n..(id + 1) * n];
        let state = &ray_state[id * RAY_STATE_FLOATS..(id + 1) * RAY_STATE_FLOATS];
        let out = &ray_out[id * RAY_OUT_FLOATS..(id + 1) * RAY_OUT_FLOATS];
        let skip = ray.masked() || load_f32(&out[11]) > 0.5;
        let g: [f32; 32] =
            core::array::from_fn(|k| load_f32(&state[STATE_APPEARANCE_GRADIENT as usize * 4 + k]));
        let ddepth = if skip { 0.0 } else { load_f32(&state[STATE_DEPTH as usize * 4 + 2]) };
        let has_depth = ray.depth > 0.0 && !skip;
        let (mut free, mut centre, mut tail) = (0.0, 0.0, 0.0);
        for &z in z {
            let e = z - ray.depth;
            if e < -p.truncation {
                free += 1.0;
            } else if e.abs() < 0.4 * p.truncation {
                centre += 1.0;
            } else if e < p.truncation {
                tail += 1.0;
            }
        }

        let (mut behind, mut loss, mut from_left) = (0.0, 0.0, 0.0);
        let (mut pose_v, mut pose_w) = ([0.0_f32; 3], [0.0_f32; 3]);
        let mut remaining = load_f32(&state[STATE_DEPTH as usize * 4 + 1]);
        for i in (0..n).rev() {
            let mut ds = from_left;
            from_left = 0.0;
            if i > 0 {
                let (phi0, phi1) = (phi(p.sharpness, s[i - 1]), phi(p.sharpness, s[i]));
                let weight = w[i - 1];
                remaining -= weight;
                let transmittance = (1.0 - remaining).max(0.0);
                let middle = 0.5 * (z[i - 1] + z[i]);
                let mut dw = ddepth * middle;
                if weight > p.min_weight && !skip {
                    let at = ray.at(middle);
                    let f = grid.lookup(planes, at);
                    dw += (0..32).map(|k| g[k] * f[k]).sum::<f32>();
                    if p.flags & FLAG_POSE != 0 {
                        let dp = grid.lookup_gradient(planes, at, &g).map(|x| x * weight);
                        let dw = cross(ray.direction.map(|x| x * middle), dp);
                        for k in 0..3 {
                            pose_v[k] += dp[k];
                            pose_w[k] += dw[k];
                        }
                    }
                }
                if phi1 < phi0 {
                    let keep = phi1 / phi0.max(1e-12);
                    let d_alpha = keep * transmittance * dw - behind;
                    from_left = p.sharpness * (1.0 - phi0) * d_alpha;
                    ds -= p.sharpness * (1.0 - phi1) * d_alpha;
                }
                behind += weight * dw;
            }
            if has_depth {
                let e = z[i] - ray.depth;
                if e < -p.truncation {
                    let (x, c) = (s[i] - 1.0, p.weight_free / free);
                    loss += c * x * x;
                    ds += 2.0 * c * x * inv_rays;
                } else if e.abs() < p.truncation {
                    let x = e + s[i] * p.truncation;
                    let c = if e.abs() < 0.4 * p.truncation {
                        p.weight_centre / centre
                    } else {
                        p.weight_tail / tail
                    };
                    loss += c * x * x;
                    ds += 2.0 * c * x * p.truncation * inv_rays;
                }
            }
            let slope = ds.abs() * (1.0 - s[i] * s[i]) * (p.rays as f32);
            let idle = slope < p.min_gradient;
            store_f32(&gradient[id * n + i], if skip || idle { 0.0 } else { ds });
        }
        store_f32(&out[9], loss);
        for k in 0..3 {
            store_f32(&state[STATE_POSE as usize * 4 + k], pose_v[k]);
            store_f32(&state[STATE_POSE as usize * 4 + 4 + k], pose_w[k]);
        }
        store_f32(&state[STATE_POSE as usize * 4 + 3], 0.0);
        store_f32(&state[STATE_POSE as usize * 4 + 7], 0.0);
    });
}
