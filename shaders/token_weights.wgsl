// Gradients of layers' weights and biases: sums over a chunk of tokens of input * delta; reduce_partials adds the chunks.
// One invocation per (chunk, tap and input, 4 outputs), or a (chunk, 4 biases).
#import shared/dispatch.wgsl
#import shared/tokens.wgsl
#import shared/token_layers.wgsl

#bindings

fn delta(token: u32, o: u32) -> f32 {
    let at = token * params.stride + layer.output + o;
    return token_gradient[at] * select(1.0, SLOPE, layer.activation == 1u && tokens[at] < 0.0);
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = start_layer(wid, groups, lane);
    let all = params.columns * params.rows;
    let taps = layer.taps * layer.taps;
    let bias_quads = (layer.outputs + 3u) / 4u;
    let quads = select(bias_quads, 1u, layer.depthwise == 1u);
    let weights = taps * layer.inputs * quads;
    let per_chunk = weights + select(0u, bias_quads, layer.bias != NONE);
    let chunks = (all + params.chunk - 1u) / params.chunk;
    if (job >= per_chunk * chunks) {
        return;
    }
    let chunk = job / per_chunk;
    let k = job % per_chunk;
    let row = chunk * params.row;
    let last = min((chunk + 1u) * params.chunk, all);
    var sum: array<f32, 4>;
    if (k >= weights) {
        let o = (k - weights) * 4u;
        let width = min(4u, layer.outputs - o);
        for (var token = chunk * params.chunk; token < last; token++) {
            for (var c = 0u; c < width; c++) {
                sum[c] += delta(token, o + c);
            }
        }
        for (var c = 0u; c < width; c++) {
            partials[row + layer.bias + o + c] = sum[c];
        }
        return;
    }
    let tap = k / quads / layer.inputs;
    let i = k / quads % layer.inputs;
    let reach = i32(layer.taps / 2u);
    let dx = i32(tap % layer.taps) - reach;
    let dy = i32(tap / layer.taps) - reach;
    var o = k % quads * 4u;
    var width = min(4u, layer.outputs - o);
    if (layer.depthwise == 1u) {
        o = i;
        width = 1u;
    }
    for (var token = chunk * params.chunk; token < last; token++) {
        let source = neighbour(token, dx, dy);
        if (source == NONE) {
            continue;
        }
        var x: f32;
        if (layer.from_raw == 1u) {
            x = raw[params.raw_at + source * params.raw_stride + layer.input + i];
        } else {
            x = tokens[source * params.stride + layer.input + i];
        }
        for (var c = 0u; c < width; c++) {
            sum[c] += x * delta(token, o + c);
        }
    }
    for (var c = 0u; c < width; c++) {
        var to = layer.weights + tap * layer.inputs * layer.outputs + i * layer.input_stride + (o + c) * layer.output_stride;
        if (layer.depthwise == 1u) {
            to = layer.weights + tap * layer.inputs + i;
        }
        partials[row + to] = sum[c];
    }
}
