// Signed distance at every sample. One invocation per sample.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl
#import shared/geometry.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_geometry_decoder(lane);
    let sample = linear_invocation(wid, groups, lane);
    if (sample >= params.rays * params.samples) {
        return;
    }
    let ray = sample / params.samples;
    var f = lookup_geometry(rays[ray].origin + depths[sample] * rays[ray].direction);
    distances[sample] = geometry_decoder(f).distance;
    if ((params.flags & (FLAG_MAP | FLAG_POSE)) != 0u) {
#for q in 0..8
        features[sample * 8u + ${q}u] = f[${q}];
#end
    }
}
