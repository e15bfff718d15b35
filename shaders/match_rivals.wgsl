// The nearest anchors of the head's class and of another, for every ray; the ray counts for the head's class from here on.
// One invocation per ray.
#import shared/dispatch.wgsl
#import shared/rays.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let ray = linear_invocation(wid, groups, lane);
    if (ray >= params.rays) {
        return;
    }
    let state = ray * ${RAY_STATE_VEC4}u;
    let class_id = bitcast<u32>(ray_out[ray * 3u + 1u].y);
    var own = ${NO_ANCHOR}u;
    var rival = ${NO_ANCHOR}u;
    var own_distance = 1e30;
    var rival_distance = 1e30;
    for (var a = 0u; a < params.anchors; a++) {
        let at = a * ${ANCHOR_VEC4}u;
        let of_anchor = bitcast<u32>(anchors[at + 4u].x);
        if (of_anchor == 255u) {
            continue;
        }
        var d = 0.0;
#for j in 0..4
        let e${j} = ray_state[state + ${STATE_FEATURE+j}u] - anchors[at + ${j}u];
        d += dot(e${j}, e${j});
#end
        if (of_anchor == class_id) {
            if (d < own_distance) {
                own = a;
                own_distance = d;
            }
        } else if (d < rival_distance) {
            rival = a;
            rival_distance = d;
        }
    }
    let label = ray_class(rays[ray]);
    if ((rays[ray].frame & 0x80000000u) == 0u && class_id < params.classes && label < params.classes) {
        atomicAdd(&class_support[2u * class_id + select(0u, 1u, label != class_id)], 1u);
    }
    rays[ray].label = (rays[ray].label & 0xffffff00u) | (class_id & 255u);
    ray_state[state + ${STATE_ANCHOR}u] = vec4f(bitcast<f32>(own), bitcast<f32>(rival), own_distance, rival_distance);
}
