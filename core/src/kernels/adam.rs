//! Sparse Adam: one step on the parameters whose gradient is not zero.
use super::{CpuDispatch, load_f32, load_i32, load_u32, or_u32, store_f32, store_u32};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Status bit: a fixed-point gradient was beyond the limit.
pub const STATUS_SATURATED: u32 = 1;
/// Status bit: a gradient was NaN or infinite.
pub const STATUS_NOT_FINITE: u32 = 2;

/// Moments smaller than this become 0: denormal numbers are slow on CPUs and unspecified on GPUs.
const TINY: f32 = 1e-30;

params! {
    /// Parameters of [`ADAM`].
    pub struct AdamParams {
        /// First parameter to update, an index into all buffers but `status`.
        offset: u32,
        /// Number of parameters to update from `offset` on.
        count: u32,
        /// 1: `gradient` holds fixed-point i32; 0: f32.
        fixed_point: u32,
        /// Fixed-point gradients beyond this are skipped and set [`STATUS_SATURATED`].
        gradient_limit: i32,
        /// The gradient is the stored value times this.
        gradient_scale: f32,
        /// Step size.
        learning_rate: f32,
        /// Decay of the first moment.
        beta1: f32,
        /// Decay of the second moment.
        beta2: f32,
        /// Added to the root of the second moment.
        epsilon: f32,
        /// 1 / (1 - beta1^t).
        correction1: f32,
        /// 1 / (1 - beta2^t).
        correction2: f32,
    }
}

kernel! {
    /// One Adam step. As in Instant-NGP, parameters with zero gradient are left alone together
    /// with their moments; after use the gradient is set to 0.
    pub static ADAM = "adam" {
        workgroup_size: 256,
        params: AdamParams,
        twin: twin,
        bindings: [
            parameters: ReadWrite,
            gradient: ReadWrite,
            moment1: ReadWrite,
            moment2: ReadWrite,
            status: ReadWrite,
        ],
    }
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
    let (parameters, gradient) = (dispatch.write(0), dispatch.write(1));
    let (moment1, moment2, status) = (dispatch.write(2), dispatch.write(3), dispatch.write(4));
    dispatch.for_each_invocation(|id| {
        if id >= p.count as usize {
            return;
        }
        let i = p.offset as usize + id;
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
    });
}
