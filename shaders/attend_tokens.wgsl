// Cross-attention softmax(Q K^T / sqrt(16)) V over the tokens of an image (paper eqs. 1-4), streamed over tiles of keys
// with an online softmax. One invocation per query.
#import shared/tokens.wgsl

#bindings

var<workgroup> keys: array<vec4f, 256>;
var<workgroup> values: array<vec4f, 256>;

fn four(at: u32) -> vec4f {
    return vec4f(tokens[at], tokens[at + 1u], tokens[at + 2u], tokens[at + 3u]);
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let count = params.columns * params.rows;
    let token = wid.x * 64u + lane;
    let row = min(token, count - 1u) * params.stride;
#for j in 0..4
    let q${j} = four(row + params.query + ${j*4}u) * 0.25;
    var o${j} = vec4f(0.0);
#end
    var largest = -1e30;
    var sum = 0.0;
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
            let top = max(largest, s);
            let keep = exp(largest - top);
            let w = exp(s - top);
            largest = top;
            sum = sum * keep + w;
#for j in 0..4
            o${j} = o${j} * keep + w * values[k + ${j}u];
#end
        }
    }
    if (token >= count) {
        return;
    }
    let inv = 1.0 / sum;
#for j in 0..4
    {
        var x = o${j} * inv;
        if (params.residual != NONE) {
            x += four(row + params.residual + ${j*4}u);
        }
        let to = row + params.output + ${j*4}u;
        tokens[to] = x.x;
        tokens[to + 1u] = x.y;
        tokens[to + 2u] = x.z;
        tokens[to + 3u] = x.w;
    }
#end
    tokens[row + params.statistics] = largest + log(sum);
}
