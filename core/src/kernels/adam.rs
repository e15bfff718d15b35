//! Sparse Adam: one step on the parameters whose gradient is not zero.
pub use mte_slam_shaders::kernels::adam::AdamParams;

use crate::kernel::{CpuDispatch, load_f32, load_i32, load_u32, or_u32, store_f32, store_u32};
use crate::{call::Call, commands::Commands};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Status bit: a fixed-point gradient was beyond the limit.
pub const STATUS_SATURATED: u32 = 1;
/// Status bit: a gradient was NaN or infinite.
pub const STATUS_NOT_FINITE: u32 = 2;

/// Moments smaller than this become 0: denormal numbers are slow on CPUs and unspecified on GPUs.
const TINY: f32 = 1e-30;

kernel! { pub static ADAM = mte_slam_shaders::kernels::adam, twin }

/// Parameters that [`record`] leaves to one invocation. With a tenth of the gradients not zero, a
/// software adapter takes a quarter of the time that one parameter an invocation takes.
const PARAMETERS_PER_INVOCATION: usize = 32;

/// Records a step. Any number of workgroups gives the same result; this one is quick.
pub fn record(commands: &mut Commands, params: &AdamParams, buffers: Buffers) {
    let invocations = (params.count as usize).div_ceil(PARAMETERS_PER_INVOCATION);
    buffers.record(commands, params, invocations);
}

/// The bits of a NaN or an infinity.
fn not_finite(bits: u32) -> bool {
    bits & 0x7f80_0000 == 0x7f80_0000
}

fn flush(x: f32) -> f32 {
    if x.abs() < TINY { 0.0 } else { x }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: AdamParams = dispatch.params();
    let Views { parameters, gradient, moment1, moment2, status } = dispatch.views();
    let update = |i: usize| {
        let bits = load_u32(&gradient[i]);
        let g = if p.fixed_point == 1 {
            let fixed = load_i32(&gradient[i]);
            if fixed == 0 {
                return;
            }
            store_u32(&gradient[i], 0);
            if fixed > p.gradient_limit || fixed < p.gradient_limit.wrapping_neg() {
                or_u32(&status[0], STATUS_SATURATED);
                return;
            }
            fixed as f32 * p.gradient_scale
        } else {
            if bits & 0x7fff_ffff == 0 {
                return;
            }
            store_u32(&gradient[i], 0);
            if not_finite(bits) {
                or_u32(&status[0], STATUS_NOT_FINITE);
                return;
            }
            f32::from_bits(bits) * p.gradient_scale
        };
        let square = g * g;
        if not_finite(square.to_bits()) {
            or_u32(&status[0], STATUS_NOT_FINITE);
            return;
        }
        let m = flush(p.beta1 * load_f32(&moment1[i]) + (1.0 - p.beta1) * g);
        let v = flush(p.beta2 * load_f32(&moment2[i]) + (1.0 - p.beta2) * square);
        store_f32(&moment1[i], m);
        store_f32(&moment2[i], v);
        let step = p.learning_rate * (m * p.correction1) / ((v * p.correction2).sqrt() + p.epsilon);
        store_f32(&parameters[i], load_f32(&parameters[i]) - step);
    };
    let stride = dispatch.invocations();
    dispatch.for_each_invocation(|id| {
        let last = p.offset as usize + p.count as usize;
        (p.offset as usize + id..last).step_by(stride).for_each(update);
    });
}
