// Signed distance at every sample. One invocation a sample.
#import shared/dispatch.wgsl
#import shared/params.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl

@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read> depths: array<f32>;
@group(0) @binding(3) var<storage, read> planes_geometry: array<vec4f>;
@group(0) @binding(4) var<storage, read> decoders: array<vec4f>;
// 8 vec4 a sample, kept for the backward pass.
@group(0) @binding(5) var<storage, read_write> features: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> distances: array<f32>;

#import shared/geometry.wgsl

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
