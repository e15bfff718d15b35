// Adds the gradients at a ray's sample positions to its pose gradient (translation, rotation about the
// camera's centre, both in world axes). One invocation per ray.
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
    var v = ray_state[state + ${STATE_POSE}u].xyz;
    var w = ray_state[state + ${STATE_POSE+1}u].xyz;
    var moment = vec3f(0.0);
    for (var i = 0u; i < params.samples; i++) {
        let k = ray * params.samples + i;
        let dp = position_gradient[k].xyz;
        v += dp;
        moment += depths[k] * dp;
    }
    w += cross(rays[ray].direction, moment);
    ray_state[state + ${STATE_POSE}u] = vec4f(v, 0.0);
    ray_state[state + ${STATE_POSE+1}u] = vec4f(w, 0.0);
}
