// Semantic plane features of a ray's samples, for a head that runs on every one of them. One invocation a (ray, slot).
// As many slots as samples: slot i is interval i. Fewer (views): the first intervals that carry weight, front to back.
#import shared/dispatch.wgsl
#import shared/params.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl

@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read> depths: array<f32>;
@group(0) @binding(3) var<storage, read> weights: array<f32>;
@group(0) @binding(4) var<storage, read> planes_semantic: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> features: array<vec4f>;
// Middle of the slot's interval along the ray, and its weight: 0 for an empty slot.
@group(0) @binding(6) var<storage, read_write> slot_depths: array<f32>;
@group(0) @binding(7) var<storage, read_write> slot_weights: array<f32>;

#import shared/semantic.wgsl

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
