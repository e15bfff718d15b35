// Gradients through the gating, from F to the gate's convolution and the three modalities. One invocation per token.
#import shared/dispatch.wgsl
#import shared/tokens.wgsl

#bindings

fn sigmoid(x: f32) -> f32 {
    return 1.0 / (1.0 + exp(-x));
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let token = linear_invocation(wid, groups, lane);
    if (token >= params.columns * params.rows) {
        return;
    }
    let row = token * params.stride;
    let at = row + ${GATE_AT}u;
    let part = row + ${GEOMETRY_AT}u;
    let s = vec3f(sigmoid(tokens[at]), sigmoid(tokens[at + 1u]), sigmoid(tokens[at + 2u]));
    let weight = vec3f(tokens[at + 4u], tokens[at + 5u], tokens[at + 6u]);
    var d = vec3f(0.0);
    for (var c = 0u; c < 16u; c++) {
        let g = token_gradient[row + ${FUSED_AT}u + c];
        d += g * vec3f(tokens[part + c], tokens[part + 16u + c], tokens[part + 32u + c]);
        token_gradient[part + c] += weight.x * g;
        token_gradient[part + 16u + c] += weight.y * g;
        token_gradient[part + 32u + c] += weight.z * g;
    }
    let z = (d - dot(weight, d)) / (s.x + s.y + s.z) * s * (1.0 - s);
    token_gradient[at] += z.x;
    token_gradient[at + 1u] += z.y;
    token_gradient[at + 2u] += z.z;
}
