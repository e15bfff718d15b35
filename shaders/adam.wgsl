// Sparse Adam: one step on the parameters whose gradient is not zero. Twin: kernels/adam.rs.
#import shared/dispatch.wgsl

#bindings

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

fn update(i: u32) {
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

// The next parameter of this invocation, without wrapping around.
fn next(id: u32, stride: u32) -> u32 {
    return select(params.count, id + stride, stride < params.count - id);
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    // Whatever the number of workgroups, all parameters get their turn.
    let stride = workgroups.x * workgroups.y * workgroups.z * WORKGROUP_SIZE;
    var id = linear_invocation(workgroup, workgroups, local);
    loop {
        // Software adapters run both sides of every branch, so zeros are skipped by a loop of
        // their own; most gradients are zero.
        while (id < params.count && gradient[params.offset + id] == 0u) {
            id = next(id, stride);
        }
        if (id >= params.count) {
            break;
        }
        update(params.offset + id);
        id = next(id, stride);
    }
}
