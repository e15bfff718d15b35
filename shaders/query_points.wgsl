// The field at single points: signed distance, color, class. One invocation per point.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/planes.wgsl
#import shared/geometry.wgsl
#import shared/appearance.wgsl
#import shared/semantic.wgsl
#import shared/surface.wgsl

#bindings

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
