// One Adam step on the pose of each window frame; one workgroup per frame, its rays summed in a fixed order.
// The pose with the smallest loss so far is kept beside (the loss belongs to the pose before the step).
#import shared/angle.wgsl

#bindings

var<workgroup> partial_v: array<vec4f, WORKGROUP_SIZE>;
var<workgroup> partial_w: array<vec4f, WORKGROUP_SIZE>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let frame = wid.x;
    var v = vec4f(0.0);
    var w = vec4f(0.0);
    for (var i = lane; i < params.rays_per_frame; i += WORKGROUP_SIZE) {
        let ray = frame * params.rays_per_frame + i;
        v += vec4f(ray_state[ray * ${RAY_STATE_VEC4}u + ${STATE_POSE}u].xyz, 0.0);
        w += vec4f(ray_state[ray * ${RAY_STATE_VEC4}u + ${STATE_POSE+1}u].xyz, 0.0);
        let a = ray_out[ray * 3u + 1u];
        let b = ray_out[ray * 3u + 2u];
        // The distance loss carries its weights already. A masked ray counts nothing.
        if (b.w < 0.5) {
            w.w += params.weight_color * a.z + params.weight_depth * a.w + b.y;
        }
    }
    partial_v[lane] = v;
    partial_w[lane] = w;
    workgroupBarrier();
    if (lane != 0u) {
        return;
    }
    v = vec4f(0.0);
    w = vec4f(0.0);
    for (var i = 0u; i < WORKGROUP_SIZE; i++) {
        v += partial_v[i];
        w += partial_w[i];
    }
    let slot = window[frame] & 0x7fffffffu;
    let s = slot * 36u;
    let p = slot * 12u;
    let loss = w.w;
    if (params.restart == 1u) {
        for (var i = 0u; i < 12u; i++) {
            pose_state[s + i] = 0.0;
        }
        pose_state[s + 12u] = 3e38;
        pose_state[s + 32u] = 0.0;
        pose_state[s + 33u] = 0.0;
    }
    // Adam's bias: a moment of ones. A difference from 1 would cancel where it is small.
    let bias1 = 0.9 * pose_state[s + 32u] + 0.1;
    let bias2 = 0.999 * pose_state[s + 33u] + 0.001;
    pose_state[s + 32u] = bias1;
    pose_state[s + 33u] = bias2;
    if (loss < pose_state[s + 12u]) {
        pose_state[s + 12u] = loss;
        for (var i = 0u; i < 12u; i++) {
            pose_state[s + 13u + i] = poses[p + i];
        }
    }
    pose_state[s + 25u] = loss;
    var step = array<f32, 6>(v.x, v.y, v.z, w.x, w.y, w.z);
    for (var i = 0u; i < 6u; i++) {
        let g = step[i];
        pose_state[s + 26u + i] = g;
        let m1 = 0.9 * pose_state[s + i] + 0.1 * g;
        let m2 = 0.999 * pose_state[s + 6u + i] + 0.001 * g * g;
        pose_state[s + i] = m1;
        pose_state[s + 6u + i] = m2;
        let rate = select(params.learning_rate_rotation, params.learning_rate_translation, i < 3u);
        step[i] = -rate * (m1 / bias1) / (sqrt(m2 / bias2) + 1e-15);
    }
    if ((window[frame] & 0x80000000u) != 0u) {
        return;
    }
    // Left retraction: R <- exp(w) R by Rodrigues' formula, t <- t + v.
    let omega = vec3f(step[3], step[4], step[5]);
    let angle = length(omega);
    var a = 1.0;
    var b = 0.5;
    if (angle > 1e-6) {
        // (1 - cos) / angle^2 = (sin(angle / 2) / (angle / 2))^2 / 2, without its cancellation.
        let half = sin_cos(0.5 * angle).x / (0.5 * angle);
        a = sin_cos(angle).x / angle;
        b = 0.5 * half * half;
    }
    for (var c = 0u; c < 3u; c++) {
        let r = vec3f(poses[p + c], poses[p + 3u + c], poses[p + 6u + c]);
        let x = cross(omega, r);
        let n = r + a * x + b * cross(omega, x);
        poses[p + c] = n.x;
        poses[p + 3u + c] = n.y;
        poses[p + 6u + c] = n.z;
    }
    poses[p + 9u] += step[0];
    poses[p + 10u] += step[1];
    poses[p + 11u] += step[2];
}
