// Gradients of the attention at its queries (and at what was added behind it). One invocation per query.
#import shared/tokens.wgsl

#bindings

var<workgroup> keys: array<vec4f, 256>;
var<workgroup> values: array<vec4f, 256>;

fn four(at: u32) -> vec4f {
    return vec4f(tokens[at], tokens[at + 1u], tokens[at + 2u], tokens[at + 3u]);
}
fn gradient_of(at: u32) -> vec4f {
    return vec4f(token_gradient[at], token_gradient[at + 1u], token_gradient[at + 2u], token_gradient[at + 3u]);
}
fn add(at: u32, v: vec4f) {
    token_gradient[at] += v.x;
    token_gradient[at + 1u] += v.y;
    token_gradient[at + 2u] += v.z;
    token_gradient[at + 3u] += v.w;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let count = params.columns * params.rows;
    let token = wid.x * 64u + lane;
    let row = min(token, count - 1u) * params.stride;
    var mean = 0.0;
#for j in 0..4
    let q${j} = four(row + params.query + ${j*4}u) * 0.25;
    let g${j} = gradient_of(row + params.output + ${j*4}u);
    var a${j} = four(row + params.output + ${j*4}u);
    if (params.residual != NONE) {
        a${j} -= four(row + params.residual + ${j*4}u);
    }
    mean += dot(g${j}, a${j});
    var d${j} = vec4f(0.0);
#end
    let log_sum = tokens[row + params.statistics];
    let total = key_count();
    for (var tile = 0u; tile < total; tile += 64u) {
        workgroupBarrier();
        if (tile + lane < total) {
            let at = key_token(tile + lane) * params.stride + params.query;
#for j in 0..4
            keys[lane * 4u + ${j}u] = four(at + ${16+j*4}u);
            values[lane * 4u + ${j}u] = four(at + ${32+j*4}u);
#end
        }
        workgroupBarrier();
        let n = min(64u, total - tile);
        for (var j = 0u; j < n; j++) {
            let k = j * 4u;
            let s = dot(q0, keys[k]) + dot(q1, keys[k + 1u]) + dot(q2, keys[k + 2u]) + dot(q3, keys[k + 3u]);
            let w = exp(min(s - log_sum, 0.0));
            let gv = dot(g0, values[k]) + dot(g1, values[k + 1u]) + dot(g2, values[k + 2u]) + dot(g3, values[k + 3u]);
            let ds = 0.25 * w * (gv - mean);
#for j in 0..4
            d${j} += ds * keys[k + ${j}u];
#end
        }
    }
    if (token >= count) {
        return;
    }
    token_gradient[row + params.statistics] = mean;
#for j in 0..4
    add(row + params.query + ${j*4}u, d${j});
    if (params.residual != NONE) {
        add(row + params.residual + ${j*4}u, g${j});
    }
#end
}
