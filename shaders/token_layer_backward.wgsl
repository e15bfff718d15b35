// Adds layers' contributions to the gradients at their inputs, of which no two share any. One invocation per (token, input).
#import shared/dispatch.wgsl
#import shared/tokens.wgsl
#import shared/token_layers.wgsl

#bindings

// Gradient before the rectifier.
fn delta(at: u32) -> f32 {
    return token_gradient[at] * select(1.0, SLOPE, layer.activation == 1u && tokens[at] < 0.0);
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = start_layer(wid, groups, lane);
    let token = job / layer.inputs;
    let i = job % layer.inputs;
    if (token >= params.columns * params.rows) {
        return;
    }
    var sum = 0.0;
    for (var tap = 0u; tap < layer.taps * layer.taps; tap++) {
        // The token whose tap this one is.
        let reach = i32(layer.taps / 2u);
        let to = neighbour(token, reach - i32(tap % layer.taps), reach - i32(tap / layer.taps));
        if (to == NONE) {
            continue;
        }
        let at = to * params.stride + layer.output;
        if (layer.depthwise == 1u) {
            sum += delta(at + i) * parameters[layer.weights + tap * layer.inputs + i];
            continue;
        }
        let w = layer.weights + (tap * layer.inputs + i) * layer.outputs;
        for (var o = 0u; o < layer.outputs; o++) {
            sum += delta(at + o) * parameters[w + o];
        }
    }
    token_gradient[token * params.stride + layer.input + i] += sum;
}
