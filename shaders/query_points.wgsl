// The field at single points: signed distance, colour, class. One invocation a point.
#import shared/dispatch.wgsl
#import shared/params.wgsl
#import shared/planes.wgsl

@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> planes_geometry: array<vec4f>;
@group(0) @binding(3) var<storage, read> planes_appearance: array<vec4f>;
@group(0) @binding(4) var<storage, read> planes_semantic: array<vec4f>;
@group(0) @binding(5) var<storage, read> decoders: array<vec4f>;
// Per anchor: vector (4) | class (bits, 255: free), ... | ...
@group(0) @binding(6) var<storage, read> anchors: array<vec4f>;
// Distance [truncations]; for params.flags & FLAG_MAP then 2 vec4 a point: distance, class (bits), 0, 0 | rgb, 0.
@group(0) @binding(7) var<storage, read_write> values: array<f32>;

#import shared/geometry.wgsl
#import shared/appearance.wgsl
#import shared/semantic.wgsl
#import shared/surface.wgsl

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_geometry_decoder(lane);
    load_surface_decoders(lane);
    let i = linear_invocation(wid, groups, lane);
    if (i >= params.rays) {
        return;
    }
    let p = points[i].xyz;
    let distance = geometry_decoder(lookup_geometry(p)).distance;
    if ((params.flags & FLAG_MAP) == 0u) {
        values[i] = distance;
        return;
    }
    let rgb = color_output(color_hidden(lookup_appearance(p)));
    var best_class = 255u;
    if (params.classes > 0u) {
        var feature = semantic_output(semantic_hidden(lookup_semantic(p)));
        if ((params.flags & FLAG_ANCHORS) != 0u) {
            // The nearest anchor stands for the feature.
            var nearest = 1e30;
            var anchor = feature;
            for (var a = 0u; a < params.anchors; a++) {
                let at = a * ${ANCHOR_VEC4}u;
                var d = 0.0;
#for j in 0..4
                let e${j} = feature[${j}] - anchors[at + ${j}u];
                d += dot(e${j}, e${j});
#end
                if (bitcast<u32>(anchors[at + 4u].x) != 255u && d < nearest) {
                    nearest = d;
                    anchor = array<vec4f, 4>(anchors[at], anchors[at + 1u], anchors[at + 2u], anchors[at + 3u]);
                }
            }
            feature = anchor;
        }
        best_class = likeliest_class(feature);
    }
    values[i * 8u] = distance;
    values[i * 8u + 1u] = bitcast<f32>(best_class);
    values[i * 8u + 4u] = rgb.x;
    values[i * 8u + 5u] = rgb.y;
    values[i * 8u + 6u] = rgb.z;
}
