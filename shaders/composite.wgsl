// Weights of a ray's intervals, composited depth, opacity and features. One invocation per ray.
// Features are composited before their decoders, which then run once a ray.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl
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
    var appearance: array<vec4f, 8>;
    var semantic: array<vec4f, 8>;
    var transmittance = 1.0;
    var depth = 0.0;
    var opacity = 0.0;
    var first = params.samples;
    var last = 0u;
    var z0 = depths[base];
    var phi0 = phi(distances[base]);
    for (var i = 1u; i < params.samples; i++) {
        let z1 = depths[base + i];
        let phi1 = phi(distances[base + i]);
        let alpha = interval_alpha(phi0, phi1);
        let w = transmittance * alpha;
        transmittance *= 1.0 - alpha;
        let z = 0.5 * (z0 + z1);
        weights[base + i - 1u] = w;
        depth += w * z;
        opacity += w;
        if (w > params.min_weight) {
            first = min(first, i - 1u);
            last = i;
        }
        z0 = z1;
        phi0 = phi1;
    }
    weights[base + params.samples - 1u] = 0.0;
    // Views show the depth that half of the light reaches: a mean over the edge of a surface would lie in the air
    // between it and what is behind.
    if ((params.flags & (FLAG_DENSE | FLAG_MAP | FLAG_POSE)) == FLAG_DENSE) {
        var before = 0.0;
        var k = 1u;
        var w = weights[base];
        while (k + 1u < params.samples && before + w < 0.5 * opacity) {
            before += w;
            w = weights[base + k];
            k++;
        }
        let t = clamp((0.5 * opacity - before) / max(w, 1e-12), 0.0, 1.0);
        let z = depths[base + k - 1u];
        depth = opacity * (z + t * (depths[base + k] - z));
    }
    // A loop of its own over the intervals that count: machines that run both sides of a branch, as lavapipe,
    // pay for every pass through a loop's body.
    var i = min(first, last);
    loop {
        while (i < last && weights[base + i] <= params.min_weight) {
            i++;
        }
        if (i >= last) {
            break;
        }
        let w = weights[base + i];
        let z = 0.5 * (depths[base + i] + depths[base + i + 1u]);
        let local = r.origin + z * r.direction - params.box_min.xyz;
        let g0 = local * params.surface_inv_cell.x;
        let g1 = local * params.surface_inv_cell.y;
#for plane in 0..3
        {
            let a = plane_corners(${plane}u, g0, params.surface_coarse);
            let b = plane_corners(${plane}u, g1, params.surface_fine);
            let ai = a.cell * 4u;
            let bi = b.cell * 4u;
            let aw = a.weight * w;
            let bw = b.weight * w;
#for q in 0..4
            appearance[${q}] += aw.x * planes_appearance[ai.x + ${q}u] + aw.y * planes_appearance[ai.y + ${q}u]
                + aw.z * planes_appearance[ai.z + ${q}u] + aw.w * planes_appearance[ai.w + ${q}u];
            appearance[${q+4}] += bw.x * planes_appearance[bi.x + ${q}u] + bw.y * planes_appearance[bi.y + ${q}u]
                + bw.z * planes_appearance[bi.z + ${q}u] + bw.w * planes_appearance[bi.w + ${q}u];
#end
            if (params.classes > 0u) {
#for q in 0..4
                semantic[${q}] += aw.x * planes_semantic[ai.x + ${q}u] + aw.y * planes_semantic[ai.y + ${q}u]
                    + aw.z * planes_semantic[ai.z + ${q}u] + aw.w * planes_semantic[ai.w + ${q}u];
                semantic[${q+4}] += bw.x * planes_semantic[bi.x + ${q}u] + bw.y * planes_semantic[bi.y + ${q}u]
                    + bw.z * planes_semantic[bi.z + ${q}u] + bw.w * planes_semantic[bi.w + ${q}u];
#end
            }
        }
#end
        i++;
    }
    let state = ray * ${RAY_STATE_VEC4}u;
#for q in 0..8
    ray_state[state + ${STATE_APPEARANCE+q}u] = appearance[${q}];
    ray_state[state + ${STATE_SEMANTIC+q}u] = semantic[${q}];
#end
    // The range of intervals that count, so that later passes need not search for them.
    ray_state[state + ${STATE_DEPTH}u] = vec4f(depth, opacity, 0.0, f32(min(first, last) * 256u + last));
}
