//! Sums the gradients at a ray's sample positions into its pose gradient.
use super::shared::cross;
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::{FieldParams, RAY_STATE_FLOATS, STATE_POSE};

kernel! { pub static POSE_GRADIENT = mte_slam_shaders::kernels::pose_gradient, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { rays, depths, position_gradient: positions, ray_state } = dispatch.views();
    let n = p.samples as usize;
    dispatch.for_each_invocation(|id| {
        if id >= p.rays as usize {
            return;
        }
        let pose = &ray_state[id * RAY_STATE_FLOATS + STATE_POSE as usize * 4..][..8];
        let mut v: [f32; 3] = core::array::from_fn(|k| load_f32(&pose[k]));
        let w: [f32; 3] = core::array::from_fn(|k| load_f32(&pose[4 + k]));
        let mut moment = [0.0; 3];
        for sample in id * n..(id + 1) * n {
            for k in 0..3 {
                let dp = positions[sample * 4 + k];
                v[k] += dp;
                moment[k] += depths[sample] * dp;
            }
        }
        let dw = cross(rays[id].direction, moment);
        for k in 0..3 {
            store_f32(&pose[k], v[k]);
            store_f32(&pose[4 + k], w[k] + dw[k]);
        }
    });
}
