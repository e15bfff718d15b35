// Layers on the token grid: linear, 3x3 or depthwise convolution, leaky rectifier. One invocation per (token, 4 outputs).
// Weights of a tap are input-major; a depthwise tap has one weight per channel. Off the grid inputs are 0.
#import shared/dispatch.wgsl
#import shared/tokens.wgsl
#import shared/token_layers.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = start_layer(wid, groups, lane);
    let quads = (layer.outputs + 3u) / 4u;
    let token = job / quads;
    let o = job % quads * 4u;
    if (token >= params.columns * params.rows) {
        return;
    }
    let count = min(4u, layer.outputs - o);
    var sum: array<f32, 4>;
    for (var k = 0u; k < count; k++) {
        if (layer.bias != NONE) {
            sum[k] = parameters[layer.bias + o + k];
        }
    }
    for (var tap = 0u; tap < layer.taps * layer.taps; tap++) {
        let reach = i32(layer.taps / 2u);
        let source = neighbour(token, i32(tap % layer.taps) - reach, i32(tap / layer.taps) - reach);
        if (source == NONE) {
            continue;
        }
        if (layer.depthwise == 1u) {
            for (var k = 0u; k < count; k++) {
                sum[k] += tokens[source * params.stride + layer.input + o + k] * parameters[layer.weights + tap * layer.inputs + o + k];
            }
            continue;
        }
        let w = layer.weights + tap * layer.inputs * layer.outputs + o;
        for (var i = 0u; i < layer.inputs; i++) {
            var x: f32;
            if (layer.from_raw == 1u) {
                x = raw[params.raw_at + source * params.raw_stride + layer.input + i];
            } else {
                x = tokens[source * params.stride + layer.input + i];
            }
            for (var k = 0u; k < count; k++) {
                sum[k] += x * parameters[w + i * layer.outputs + k];
            }
        }
    }
    for (var k = 0u; k < count; k++) {
        let y = sum[k];
        tokens[token * params.stride + layer.output + o + k] = select(y, SLOPE * y, layer.activation == 1u && y < 0.0);
    }
}
