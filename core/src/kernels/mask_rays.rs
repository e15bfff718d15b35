//! Takes outliers out of the tracking losses.
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::{FieldParams, RAY_OUT_FLOATS};

kernel! { pub static MASK_RAYS = mte_slam_shaders::kernels::mask_rays, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { ray_out } = dispatch.views();
    let error = |ray: usize| load_f32(&ray_out[ray * RAY_OUT_FLOATS + 10]);
    let mut bins = [0_u32; 512];
    for ray in 0..p.rays as usize {
        if error(ray) > 0.0 {
            bins[((error(ray).to_bits() >> 19) as i32 - 1776).clamp(0, 511) as usize] += 1;
        }
    }
    let total: u32 = bins.iter().sum();
    let (mut seen, mut i) = (0, 0);
    while i < 511 && (seen + bins[i]) * 2 < total {
        seen += bins[i];
        i += 1;
    }
    let threshold = 10.0 * f32::from_bits((i as u32 + 1777) << 19);
    for ray in 0..p.rays as usize {
        let masked = error(ray) <= 0.0 || error(ray) > threshold;
        store_f32(&ray_out[ray * RAY_OUT_FLOATS + 11], if masked { 1.0 } else { 0.0 });
    }
}
