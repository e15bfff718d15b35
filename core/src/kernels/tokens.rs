//! What the twins of the token grid's kernels share.
pub use mte_slam_shaders::tokens::*;

use crate::kernel::{CpuDispatch, load_f32};
use core::sync::atomic::AtomicU32;

/// Calls `body` with the layer and the workgroup's number within it, for all workgroups of a
/// dispatch, in parallel.
pub(super) fn for_each_layer_workgroup(
    dispatch: &CpuDispatch<'_>,
    p: &TokenParams,
    layers: &[TokenLayer],
    body: impl Fn(&TokenLayer, usize) + Sync + Send,
) {
    let [x, y, _] = dispatch.workgroups;
    dispatch.for_each_workgroup(|group| {
        body(&layers[(p.layer + group / (x * y)) as usize], (group % (x * y)) as usize);
    });
}

/// 16 floats of a buffer that other workgroups may write elsewhere.
pub(super) fn sixteen(buffer: &[AtomicU32], at: usize) -> [f32; 16] {
    core::array::from_fn(|k| load_f32(&buffer[at + k]))
}

pub(super) fn dot(a: &[f32; 16], b: &[f32; 16]) -> f32 {
    (0..16).map(|k| a[k] * b[k]).sum()
}

/// e^x for x <= 0 to a few units of the last place, in a form that compilers vectorise.
#[inline(always)]
pub(super) fn exp_negative(x: f32) -> f32 {
    let x = x.max(-87.0);
    let n = (x * core::f32::consts::LOG2_E - 0.5) as i32;
    let r = x - n as f32 * 0.693_359_4 + n as f32 * 2.121_944_4e-4;
    let p = ((((1.987_569_1e-4 * r + 1.398_2e-3) * r + 8.333_452e-3) * r + 4.166_579_6e-2) * r
        + 1.666_666_5e-1)
        * r
        + 0.5;
    let e = (p * r * r + r + 1.0) * f32::from_bits(((n + 127) << 23) as u32);
    // Products of less would be denormal, and those take a hundred times as long.
    if x < -60.0 { 0.0 } else { e }
}
