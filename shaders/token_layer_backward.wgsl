// Adds a layer's contribution to the gradients at its inputs. One invocation a (token, input).
#import shared/dispatch.wgsl
#import shared/tokens.wgsl

@group(0) @binding(1) var<storage, read> parameters: array<f32>;
@group(0) @binding(2) var<storage, read> tokens: array<f32>;
@group(0) @binding(3) var<storage, read_write> token_gradient: array<f32>;

// Gradient before the rectifier.
fn delta(at: u32) -> f32 {
    return token_gradient[at] * select(1.0, SLOPE, params.activation == 1u && tokens[at] < 0.0);
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = linear_invocation(wid, groups, lane);
    let token = job / params.inputs;
    let i = job % params.inputs;
    if (token >= params.columns * params.rows) {
        return;
    }
    var sum = 0.0;
    for (var tap = 0u; tap < params.taps * params.taps; tap++) {
        // The token whose tap this one is.
        let reach = i32(params.taps / 2u);
        let to = neighbour(token, reach - i32(tap % params.taps), reach - i32(tap / params.taps));
        if (to == NONE) {
            continue;
        }
        let at = to * params.stride + params.output;
        if (params.depthwise == 1u) {
            sum += delta(at + i) * parameters[params.weights + tap * params.inputs + i];
            continue;
        }
        let w = params.weights + (tap * params.inputs + i) * params.outputs;
        for (var o = 0u; o < params.outputs; o++) {
            sum += delta(at + o) * parameters[w + o];
        }
    }
    token_gradient[token * params.stride + params.input + i] += sum;
}
