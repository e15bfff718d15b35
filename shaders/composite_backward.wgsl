// Gradients at the signed distances: through the interval weights (depth, color), and the distance losses.
// One invocation per ray.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl
#import shared/appearance.wgsl
#import shared/weights.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let ray = linear_invocation(wid, groups, lane);
    if (ray >= params.rays) {
        return;
    }
    let r = rays[ray];
    let base = ray * params.samples;
    let state = ray * ${RAY_STATE_VEC4}u;
    let inv_rays = 1.0 / f32(params.rays);
    var g: array<vec4f, 8>;
#for q in 0..8
    g[${q}] = ray_state[state + ${STATE_APPEARANCE_GRADIENT+q}u];
#end
    var out2 = ray_out[ray * 3u + 2u];
    let skip = (r.frame & 0x80000000u) != 0u || out2.w > 0.5;
    let ddepth = select(ray_state[state + ${STATE_DEPTH}u].z, 0.0, skip);

    // How many samples each distance loss has on this ray: each is a mean, so that no ray counts more.
    let has_depth = r.depth > 0.0 && !skip;
    var count_free = 0.0;
    var count_centre = 0.0;
    var count_tail = 0.0;
    for (var i = 0u; i < params.samples; i++) {
        let e = depths[base + i] - r.depth;
        if (e < -params.truncation) {
            count_free += 1.0;
        } else if (abs(e) < 0.4 * params.truncation) {
            count_centre += 1.0;
        } else if (e < params.truncation) {
            count_tail += 1.0;
        }
    }

    // Gradient at the weight of each interval that counts, through its features; kept where the result will go.
    var pose_v = vec3f(0.0);
    var pose_w = vec3f(0.0);
    let range = u32(ray_state[state + ${STATE_DEPTH}u].w);
    let end = select(range % 256u, 0u, skip);
    var j = range / 256u;
    loop {
        while (j < end && weights[base + j] <= params.min_weight) {
            j++;
        }
        if (j >= end) {
            break;
        }
        let middle = 0.5 * (depths[base + j] + depths[base + j + 1u]);
        let p = r.origin + middle * r.direction;
        var f = lookup_appearance(p);
        var dw = 0.0;
#for q in 0..8
        dw += dot(g[${q}], f[${q}]);
#end
        distance_gradient[base + j] = dw;
        if ((params.flags & FLAG_POSE) != 0u) {
            let dp = lookup_appearance_gradient(p, g) * weights[base + j];
            pose_v += dp;
            pose_w += cross(middle * r.direction, dp);
        }
        j++;
    }

    // Backwards along the ray: `behind` = sum over later intervals of w * dL/dw.
    var behind = 0.0;
    var loss = 0.0;
    var z1 = depths[base + params.samples - 1u];
    var s1 = distances[base + params.samples - 1u];
    var phi1 = phi(s1);
    var from_left = 0.0;
    var remaining = ray_state[state + ${STATE_DEPTH}u].y;
    for (var k = params.samples; k > 0u; k--) {
        let i = k - 1u;
        // Gradient at s_i: from the interval that starts here (needs i + 1 < samples) and the one that ends here.
        var ds = from_left;
        let z = z1;
        let s = s1;
        let phi_here = phi1;
        from_left = 0.0;
        if (i > 0u) {
            z1 = depths[base + i - 1u];
            s1 = distances[base + i - 1u];
            phi1 = phi(s1);
            // Interval i - 1: from (z1, s1) to (z, s).
            let w = weights[base + i - 1u];
            remaining -= w;
            let transmittance = max(1.0 - remaining, 0.0);
            let middle = 0.5 * (z1 + z);
            var dw = ddepth * middle;
            if (w > params.min_weight && !skip) {
                dw += distance_gradient[base + i - 1u];
            }
            // alpha = 1 - phi(s) / phi(s1) where s falls, else 0.
            if (phi_here < phi1) {
                let keep = phi_here / max(phi1, 1e-12);
                let d_alpha = keep * transmittance * dw - behind;
                from_left = params.sharpness * (1.0 - phi1) * d_alpha;
                ds -= params.sharpness * (1.0 - phi_here) * d_alpha;
            }
            behind += w * dw;
        }
        if (has_depth) {
            let e = z - r.depth;
            if (e < -params.truncation) {
                let x = s - 1.0;
                let c = params.weight_free / count_free;
                loss += c * x * x;
                ds += 2.0 * c * x * inv_rays;
            } else if (abs(e) < params.truncation) {
                // In metres, as the peers' weights expect.
                let x = e + s * params.truncation;
                var c = params.weight_tail / count_tail;
                if (abs(e) < 0.4 * params.truncation) {
                    c = params.weight_centre / count_centre;
                }
                loss += c * x * x;
                ds += 2.0 * c * x * params.truncation * inv_rays;
            }
        }
        let idle = abs(ds) * (1.0 - s * s) * f32(params.rays) < params.min_gradient;
        distance_gradient[base + i] = select(ds, 0.0, skip || idle);
    }
    out2.y = loss;
    ray_out[ray * 3u + 2u] = out2;
    ray_state[state + ${STATE_POSE}u] = vec4f(pose_v, 0.0);
    ray_state[state + ${STATE_POSE+1}u] = vec4f(pose_w, 0.0);
}
