// What trains the fusion: class-balanced cross-entropy and L1 of the color, both read from F. F itself becomes the target
// of the rays in the token's patch. One invocation per token.
#import shared/dispatch.wgsl
#import shared/tokens.wgsl

#bindings

fn logit(row: u32, c: u32) -> f32 {
    let head = ${HEAD_VEC4*4}u;
    var l = decoders[head + params.classes * 16u + c];
    for (var k = 0u; k < 16u; k++) {
        l += decoders[head + c * 16u + k] * tokens[row + ${FUSED_AT}u + k];
    }
    return l;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let token = linear_invocation(wid, groups, lane);
    let count = params.columns * params.rows;
    if (token >= count) {
        return;
    }
    let row = token * params.stride;
    let source = token * params.raw_stride;
    let f = row + ${FUSED_AT}u;
    let to = (params.slot * count + token) * ${TARGET_VEC4}u;
#for j in 0..4
    targets[to + ${j}u] = vec4f(tokens[f + ${j*4}u], tokens[f + ${j*4+1}u], tokens[f + ${j*4+2}u], tokens[f + ${j*4+3}u]);
#end
    // A patch across a boundary has no feature that fits all its pixels.
    var share = 0.0;
    for (var c = 0u; c < params.classes; c++) {
        share = max(share, raw[source + ${RAW_HISTOGRAM}u + c]);
    }
    var best = -1e30;
    for (var c = 0u; c < params.classes; c++) {
        best = max(best, logit(row, c));
    }
    targets[to + 4u] = vec4f(raw[source + ${RAW_POINT+3}u] * max(2.0 * share - 1.0, 0.0), best, 0.0, 0.0);
    if (params.train == 0u) {
        return;
    }

    let inv = 1.0 / f32(count);
    var sum = 0.0;
    var mass = 0.0;
    var mean = 0.0;
    for (var c = 0u; c < params.classes; c++) {
        let l = logit(row, c);
        sum += exp(l - best);
        let t = raw[source + ${RAW_HISTOGRAM}u + c] * class_weights[c];
        mass += t;
        mean += t * l;
    }
    var loss = params.weight_class * (mass * (best + log(sum)) - mean);
    var g: array<f32, 16>;
    for (var c = 0u; c < params.classes; c++) {
        let t = raw[source + ${RAW_HISTOGRAM}u + c] * class_weights[c];
        let d = params.weight_class * inv * (mass * exp(logit(row, c) - best) / sum - t);
        token_gradient[row + ${LOGITS_AT}u + c] = d;
        for (var k = 0u; k < 16u; k++) {
            g[k] += d * decoders[${HEAD_VEC4*4}u + c * 16u + k];
        }
    }
    for (var k = 0u; k < 3u; k++) {
        var z = parameters[params.color_head + 64u + k];
        for (var c = 0u; c < 16u; c++) {
            z += parameters[params.color_head + c * 4u + k] * tokens[f + c];
        }
        let y = 1.0 / (1.0 + exp(-z));
        let e = y - raw[source + ${RAW_MEAN}u + k];
        loss += params.weight_color * abs(e) / 3.0;
        let d = params.weight_color * inv / 3.0 * sign(e) * y * (1.0 - y);
        tokens[row + ${COLOR_AT}u + k] = y;
        token_gradient[row + ${COLOR_AT}u + k] = d;
        for (var c = 0u; c < 16u; c++) {
            g[c] += d * parameters[params.color_head + c * 4u + k];
        }
    }
    tokens[row + ${COLOR_AT+3}u] = loss;
    for (var c = 0u; c < 16u; c++) {
        token_gradient[f + c] += g[c];
    }
}
