// Sparse Adam: one step on the parameters whose gradient is not zero. Twin: kernels/adam.rs.
#import shared/dispatch.wgsl

struct Params {
    offset: u32,
    count: u32,
    fixed_point: u32,
    gradient_limit: i32,
    gradient_scale: f32,
    learning_rate: f32,
    beta1: f32,
    beta2: f32,
    epsilon: f32,
    correction1: f32,
    correction2: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> parameters: array<f32>;
@group(0) @binding(2) var<storage, read_write> gradient: array<u32>;
@group(0) @binding(3) var<storage, read_write> moment1: array<f32>;
@group(0) @binding(4) var<storage, read_write> moment2: array<f32>;
@group(0) @binding(5) var<storage, read_write> status: array<atomic<u32>>;

const SATURATED: u32 = 1u;
const NOT_FINITE: u32 = 2u;

// By bit pattern: compilers may assume that floats are finite.
fn not_finite(bits: u32) -> bool {
    return (bits & 0x7f800000u) == 0x7f800000u;
}

// Denormal moments are slow on CPUs and unspecified on GPUs.
fn flush(x: f32) -> f32 {
    return select(x, 0.0, abs(x) < 1e-30);
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let id = linear_invocation(workgroup, workgroups, local);
    if (id >= params.count) {
        return;
    }
    let i = params.offset + id;
    let bits = gradient[i];
    var stored: f32;
    if (params.fixed_point == 1u) {
        let fixed = bitcast<i32>(bits);
        if (fixed == 0) {
            return;
        }
        gradient[i] = 0u;
        if (fixed > params.gradient_limit || fixed < -params.gradient_limit) {
            atomicOr(&status[0], SATURATED);
            return;
        }
        stored = f32(fixed);
    } else {
        if ((bits & 0x7fffffffu) == 0u) {
            return;
        }
        gradient[i] = 0u;
        if (not_finite(bits)) {
            atomicOr(&status[0], NOT_FINITE);
            return;
        }
        stored = bitcast<f32>(bits);
    }
    let g = stored * params.gradient_scale;
    let square = g * g;
    if (not_finite(bitcast<u32>(square))) {
        atomicOr(&status[0], NOT_FINITE);
        return;
    }
    let m = flush(params.beta1 * moment1[i] + (1.0 - params.beta1) * g);
    let v = flush(params.beta2 * moment2[i] + (1.0 - params.beta2) * square);
    moment1[i] = m;
    moment2[i] = v;
    parameters[i] -= params.learning_rate * (m * params.correction1)
        / (sqrt(v * params.correction2) + params.epsilon);
}
