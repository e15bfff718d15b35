// The map's semantic feature at each token's point, an input of the fusion. One invocation per token.
#import shared/dispatch.wgsl
#import shared/planes.wgsl
#import shared/semantic.wgsl
#import shared/surface.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_surface_decoders(lane);
    let token = linear_invocation(wid, groups, lane);
    if (token >= params.token_columns * params.token_rows) {
        return;
    }
    let out = token * params.raw_stride;
    let at = out + ${RAW_POINT}u;
    if (raw[at + 3u] == 0.0) {
        return;
    }
    let hidden = semantic_hidden(lookup_semantic(vec3f(raw[at], raw[at + 1u], raw[at + 2u])));
    let feature = semantic_output(hidden);
    for (var j = 0u; j < 4u; j++) {
        for (var k = 0u; k < 4u; k++) {
            var f = feature;
            raw[out + ${RAW_MEMORY}u + j * 4u + k] = f[j][k];
        }
    }
}
