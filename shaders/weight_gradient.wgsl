// Gradients of the decoders that run once a ray: dW[i][o] = sum over rays of input_i * delta_o, and the bias.
// One invocation per (chunk of rays, i, four o); chunks are summed by reduce_partials. Input row I is the bias (input 1).
#import shared/dispatch.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = linear_invocation(wid, groups, lane);
    let quads = (params.outputs + 3u) / 4u;
    let per_chunk = (params.inputs + 1u) * quads;
    let chunks = (params.rays + params.chunk - 1u) / params.chunk;
    if (job >= per_chunk * chunks) {
        return;
    }
    let chunk = job / per_chunk;
    let k = job % per_chunk;
    let i = k / quads;
    let o = (k % quads) * 4u;
    let is_bias = i == params.inputs;
    var sum = vec4f(0.0);
    let last = min((chunk + 1u) * params.chunk, params.rays);
    for (var ray = chunk * params.chunk; ray < last; ray++) {
        let state = ray * ${RAY_STATE_VEC4*4}u;
        var x = 1.0;
        if (!is_bias) {
            x = ray_state[state + params.input_offset + i];
        }
        var d: vec4f;
        if (params.from_logits == 1u) {
            // The last quad reads on into the next ray; what it sums there is not stored.
            let at = ray * params.outputs + o;
            d = vec4f(logits_gradient[at], logits_gradient[at + 1u], logits_gradient[at + 2u], logits_gradient[at + 3u]);
        } else {
            let at = state + params.delta_offset + o;
            d = vec4f(ray_state[at], ray_state[at + 1u], ray_state[at + 2u], ray_state[at + 3u]);
        }
        sum += x * d;
    }
    for (var c = 0u; c < 4u && o + c < params.outputs; c++) {
        var target_index = params.weight_offset + i * params.input_stride + (o + c) * params.output_stride;
        if (is_bias) {
            target_index = params.bias_offset + o + c;
        }
        partials[chunk * params.row + target_index] = sum[c];
    }
}
