// From gradients at the signed distances to gradients at the plane features (written over the features) and,
// for pose refinement, at the sample positions. One invocation per strip of samples.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl
#import shared/geometry.wgsl
#import shared/geometry_gradient.wgsl

#bindings

const STRIP: u32 = ${BACKWARD_STRIP}u;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_geometry_decoder(lane);
    // A strip of samples per invocation, idle ones skipped in a loop of their own (see composite).
    let count = params.rays * params.samples;
    // Interleaved, so that every lane gets its share of the samples near surfaces.
    let first = linear_workgroup(wid, groups) * WORKGROUP_SIZE * STRIP + lane;
    let end = min(first + STRIP * WORKGROUP_SIZE, count);
    for (var i = first; i < end; i += WORKGROUP_SIZE) {
        if (distance_gradient[i] == 0.0) {
            if ((params.flags & FLAG_MAP) != 0u) {
#for q in 0..8
                features[i * 8u + ${q}u] = vec4f(0.0);
#end
            }
            if ((params.flags & FLAG_POSE) != 0u) {
                position_gradient[i] = vec4f(0.0);
            }
        }
    }
    var sample = first;
    loop {
        while (sample < end && distance_gradient[sample] == 0.0) {
            sample += WORKGROUP_SIZE;
        }
        if (sample >= end) {
            break;
        }
        let g = distance_gradient[sample];
        var f: array<vec4f, 8>;
#for q in 0..8
        f[${q}] = features[sample * 8u + ${q}u];
#end
        f = geometry_feature_gradient(geometry_deltas(geometry_decoder(f), g));
        if ((params.flags & FLAG_POSE) != 0u) {
            let ray = sample / params.samples;
            let dp = lookup_geometry_gradient(rays[ray].origin + depths[sample] * rays[ray].direction, f);
            position_gradient[sample] = vec4f(dp, 0.0);
        }
        if ((params.flags & FLAG_MAP) != 0u) {
#for q in 0..8
            features[sample * 8u + ${q}u] = f[${q}];
#end
        }
        sample += WORKGROUP_SIZE;
    }
}
