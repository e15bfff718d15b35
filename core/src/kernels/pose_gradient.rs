//! Sums the gradients at a ray's sample positions into its pose gradient.
use super::shared::{Ray, cross};
use super::{CpuDispatch, load_f32, store_f32};
use crate::layout::{FieldParams, RAY_STATE_FLOATS, STATE_POSE};

kernel! {
    /// Pose gradient of each ray: translation, and rotation about the camera's centre.
    pub static POSE_GRADIENT = "pose_gradient" {
        workgroup_size: 64,
        params: FieldParams,
        twin: twin,
        bindings: [rays: Read, depths: Read, position_gradient: Read, ray_state: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let (rays, depths, positions) =
        (dispatch.read_f32(0), dispatch.read_f32(1), dispatch.read_f32(2));
    let ray_state = dispatch.write(3);
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
        let dw = cross(Ray::load(rays, id).direction, moment);
        for k in 0..3 {
            store_f32(&pose[k], v[k]);
            store_f32(&pose[4 + k], w[k] + dw[k]);
        }
    });
}
