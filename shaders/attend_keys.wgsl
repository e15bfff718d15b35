// Gradients of the attention at its keys and values, streamed over tiles of queries. One invocation per key.
#import shared/tokens.wgsl

#bindings

var<workgroup> queries: array<vec4f, 256>;
var<workgroup> gradients: array<vec4f, 256>;
// Log-sum-exp, sum of output x gradient.
var<workgroup> statistics: array<vec2f, 64>;

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
    let total = key_count();
    let key = wid.x * 64u + lane;
    let at = key_token(min(key, total - 1u)) * params.stride + params.query;
#for j in 0..4
    let k${j} = four(at + ${16+j*4}u) * 0.25;
    let v${j} = four(at + ${32+j*4}u);
    var dk${j} = vec4f(0.0);
    var dv${j} = vec4f(0.0);
#end
    let count = params.columns * params.rows;
    for (var tile = 0u; tile < count; tile += 64u) {
        workgroupBarrier();
        if (tile + lane < count) {
            let row = (tile + lane) * params.stride;
#for j in 0..4
            queries[lane * 4u + ${j}u] = four(row + params.query + ${j*4}u);
            gradients[lane * 4u + ${j}u] = gradient_of(row + params.output + ${j*4}u);
#end
            statistics[lane] = vec2f(tokens[row + params.statistics], token_gradient[row + params.statistics]);
        }
        workgroupBarrier();
        let n = min(64u, count - tile);
        for (var i = 0u; i < n; i++) {
            let q = i * 4u;
            let s = dot(k0, queries[q]) + dot(k1, queries[q + 1u]) + dot(k2, queries[q + 2u]) + dot(k3, queries[q + 3u]);
            let w = exp(min(s - statistics[i].x, 0.0));
            let gv = dot(v0, gradients[q]) + dot(v1, gradients[q + 1u]) + dot(v2, gradients[q + 2u]) + dot(v3, gradients[q + 3u]);
            let ds = 0.25 * w * (gv - statistics[i].y);
#for j in 0..4
            dk${j} += ds * queries[q + ${j}u];
            dv${j} += w * gradients[q + ${j}u];
#end
        }
    }
    if (key >= total) {
        return;
    }
#for j in 0..4
    add(at + ${16+j*4}u, dk${j});
    add(at + ${32+j*4}u, dv${j});
#end
}
