//! One Adam step on the pose of each window frame.
pub use mte_slam_shaders::kernels::pose_step::PoseStepParams;

use super::shared::{cross, sin_cos};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::{RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_POSE};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Floats a slot takes in `pose_state`: moments (6 + 6), best loss, best pose (12), loss of this
/// step, gradient (6), Adam's bias of both moments, 2 unused.
pub const POSE_STATE_FLOATS: usize = 36;
/// Index of the best loss in a frame's state.
pub const POSE_BEST_LOSS: usize = 12;

kernel! { pub static POSE_STEP = mte_slam_shaders::kernels::pose_step, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: PoseStepParams = dispatch.params();
    let Views { ray_state, ray_out, window, poses, pose_state } = dispatch.views();
    dispatch.for_each_workgroup(|frame| {
        let mut step = [0.0_f32; 6];
        let mut loss = 0.0;
        for ray in frame * p.rays_per_frame..(frame + 1) * p.rays_per_frame {
            let s = &ray_state[ray as usize * RAY_STATE_FLOATS + STATE_POSE as usize * 4..][..8];
            let out = &ray_out[ray as usize * RAY_OUT_FLOATS..][..RAY_OUT_FLOATS];
            for k in 0..3 {
                step[k] += s[k];
                step[3 + k] += s[4 + k];
            }
            if out[11] < 0.5 {
                loss += p.weight_color * out[6] + p.weight_depth * out[7] + out[9];
            }
        }
        let slot = (window[frame as usize] & 0x7fff_ffff) as usize;
        let s = &pose_state[slot * POSE_STATE_FLOATS..][..POSE_STATE_FLOATS];
        let pose = &poses[slot * 12..][..12];
        if p.restart == 1 {
            s[..12].iter().for_each(|x| store_f32(x, 0.0));
            store_f32(&s[POSE_BEST_LOSS], 3e38);
            store_f32(&s[32], 0.0);
            store_f32(&s[33], 0.0);
        }
        // Adam's bias: a moment of ones. A difference from 1 would cancel where it is small.
        let bias1 = 0.9 * load_f32(&s[32]) + 0.1;
        let bias2 = 0.999 * load_f32(&s[33]) + 0.001;
        store_f32(&s[32], bias1);
        store_f32(&s[33], bias2);
        if loss < load_f32(&s[POSE_BEST_LOSS]) {
            store_f32(&s[POSE_BEST_LOSS], loss);
            for k in 0..12 {
                store_f32(&s[13 + k], load_f32(&pose[k]));
            }
        }
        store_f32(&s[25], loss);
        for k in 0..6 {
            let g = step[k];
            store_f32(&s[26 + k], g);
            let m1 = 0.9 * load_f32(&s[k]) + 0.1 * g;
            let m2 = 0.999 * load_f32(&s[6 + k]) + 0.001 * g * g;
            store_f32(&s[k], m1);
            store_f32(&s[6 + k], m2);
            let rate = if k < 3 { p.learning_rate_translation } else { p.learning_rate_rotation };
            step[k] = -rate * (m1 / bias1) / ((m2 / bias2).sqrt() + 1e-15);
        }
        if window[frame as usize] & 0x8000_0000 != 0 {
            return;
        }
        let omega = [step[3], step[4], step[5]];
        let angle = omega.iter().map(|x| x * x).sum::<f32>().sqrt();
        let (mut a, mut b) = (1.0, 0.5);
        if angle > 1e-6 {
            // (1 - cos) / angle^2 = (sin(angle / 2) / (angle / 2))^2 / 2, without its cancellation.
            let half = sin_cos(0.5 * angle)[0] / (0.5 * angle);
            a = sin_cos(angle)[0] / angle;
            b = 0.5 * half * half;
        }
        for c in 0..3 {
            let r = [load_f32(&pose[c]), load_f32(&pose[3 + c]), load_f32(&pose[6 + c])];
            let x = cross(omega, r);
            let y = cross(omega, x);
            for k in 0..3 {
                store_f32(&pose[3 * k + c], r[k] + a * x[k] + b * y[k]);
            }
        }
        for k in 0..3 {
            store_f32(&pose[9 + k], load_f32(&pose[9 + k]) + step[k]);
        }
    });
}
