// Semantic plane features of a ray's samples, for a head that runs on every one of them. One invocation per (ray, slot).
// As many slots as samples: slot i is interval i. Fewer (views): the first intervals that carry weight, front to back.
#import shared/dispatch.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl
#import shared/semantic.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = linear_invocation(wid, groups, lane);
    if (job >= params.rays * params.slots) {
        return;
    }
    let ray = job / params.slots;
    let slot = job % params.slots;
    let base = ray * params.samples;
    var i = slot;
    if (params.slots < params.samples) {
        var left = slot;
        i = 0u;
        while (i < params.samples) {
            if (weights[base + i] > params.min_weight) {
                if (left == 0u) {
                    break;
                }
                left--;
            }
            i++;
        }
    }
    var z = 0.0;
    var weight = 0.0;
    var f: array<vec4f, 8>;
    if (i < params.samples) {
        weight = weights[base + i];
        z = 0.5 * (depths[base + i] + depths[base + min(i + 1u, params.samples - 1u)]);
        f = lookup_semantic(rays[ray].origin + z * rays[ray].direction);
    }
    slot_depths[job] = z;
    slot_weights[job] = weight;
    for (var q = 0u; q < 8u; q++) {
        features[job * 8u + q] = f[q];
    }
}
