// Normalised gating and fusion of geometry, local semantics and refined appearance (paper eqs. 7, 8). One invocation per token.
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
    var gate = vec3f(sigmoid(tokens[at]), sigmoid(tokens[at + 1u]), sigmoid(tokens[at + 2u]));
    gate /= gate.x + gate.y + gate.z;
    tokens[at + 4u] = gate.x;
    tokens[at + 5u] = gate.y;
    tokens[at + 6u] = gate.z;
    let part = row + ${GEOMETRY_AT}u;
    for (var c = 0u; c < 16u; c++) {
        tokens[row + ${FUSED_AT}u + c] = gate.x * tokens[part + c] + gate.y * tokens[part + 16u + c] + gate.z * tokens[part + 32u + c];
    }
}
