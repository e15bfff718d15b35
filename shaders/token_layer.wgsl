// A layer on the token grid: linear, 3x3 or depthwise convolution, leaky rectifier. One invocation a (token, 4 outputs).
// Weights of a tap are input-major; a depthwise tap has one weight a channel. Off the grid inputs are 0.
#import shared/dispatch.wgsl
#import shared/tokens.wgsl

@group(0) @binding(1) var<storage, read> parameters: array<f32>;
@group(0) @binding(2) var<storage, read> raw: array<f32>;
// Inputs and outputs are different columns of a token's row.
@group(0) @binding(3) var<storage, read_write> tokens: array<f32>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = linear_invocation(wid, groups, lane);
    let quads = (params.outputs + 3u) / 4u;
    let token = job / quads;
    let o = job % quads * 4u;
    if (token >= params.columns * params.rows) {
        return;
    }
    let count = min(4u, params.outputs - o);
    var sum: array<f32, 4>;
    for (var k = 0u; k < count; k++) {
        if (params.bias != NONE) {
            sum[k] = parameters[params.bias + o + k];
        }
    }
    for (var tap = 0u; tap < params.taps * params.taps; tap++) {
        let reach = i32(params.taps / 2u);
        let source = neighbour(token, i32(tap % params.taps) - reach, i32(tap / params.taps) - reach);
        if (source == NONE) {
            continue;
        }
        if (params.depthwise == 1u) {
            for (var k = 0u; k < count; k++) {
                sum[k] += tokens[source * params.stride + params.input + o + k] * parameters[params.weights + tap * params.inputs + o + k];
            }
            continue;
        }
        let w = params.weights + tap * params.inputs * params.outputs + o;
        for (var i = 0u; i < params.inputs; i++) {
            var x: f32;
            if (params.from_raw == 1u) {
                x = raw[source * params.raw_stride + params.input + i];
            } else {
                x = tokens[source * params.stride + params.input + i];
            }
            for (var k = 0u; k < count; k++) {
                sum[k] += x * parameters[w + i * params.outputs + k];
            }
        }
    }
    for (var k = 0u; k < count; k++) {
        let y = sum[k];
        tokens[token * params.stride + params.output + o + k] = select(y, SLOPE * y, params.activation == 1u && y < 0.0);
    }
}
