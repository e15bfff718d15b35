// From gradients at the signed distances to gradients at the plane features (written over the features) and,
// for pose refinement, at the sample positions. One invocation a sample.
#import shared/dispatch.wgsl
#import shared/params.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl

@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read> depths: array<f32>;
@group(0) @binding(3) var<storage, read> planes_geometry: array<vec4f>;
@group(0) @binding(4) var<storage, read> decoders: array<vec4f>;
@group(0) @binding(5) var<storage, read> distance_gradient: array<f32>;
@group(0) @binding(6) var<storage, read_write> features: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> position_gradient: array<vec4f>;

#import shared/geometry.wgsl
#import shared/geometry_gradient.wgsl

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_geometry_decoder(lane);
    let sample = linear_invocation(wid, groups, lane);
    if (sample >= params.rays * params.samples) {
        return;
    }
    let g = distance_gradient[sample];
    var f: array<vec4f, 8>;
    var dp = vec3f(0.0);
    if (g != 0.0) {
#for q in 0..8
        f[${q}] = features[sample * 8u + ${q}u];
#end
        f = geometry_feature_gradient(geometry_deltas(geometry_decoder(f), g));
        if ((params.flags & FLAG_POSE) != 0u) {
            let ray = sample / params.samples;
            dp = lookup_geometry_gradient(rays[ray].origin + depths[sample] * rays[ray].direction, f);
        }
    }
    if ((params.flags & FLAG_MAP) != 0u) {
#for q in 0..8
        features[sample * 8u + ${q}u] = f[${q}];
#end
    }
    if ((params.flags & FLAG_POSE) != 0u) {
        position_gradient[sample] = vec4f(dp, 0.0);
    }
}
