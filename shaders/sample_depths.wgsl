// Places the samples of each ray, sorted. One invocation per ray.
// With a depth: stratified up to behind the surface, and stratified around it. Without: the trained signed
// distance at the stratified samples gives weights, and the second round is drawn from them.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/random.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl
#import shared/geometry.wgsl
#import shared/weights.wgsl

#bindings

fn jitter(ray: u32, k: u32) -> f32 {
    if ((params.flags & FLAG_DENSE) != 0u) {
        return 0.5;
    }
    return random_f32(params.seed, params.iteration, ray * 256u + k, ${SALT_JITTER}u);
}

// Depth at which the ray leaves the box.
fn exit_depth(origin: vec3f, direction: vec3f) -> f32 {
    let inv = 1.0 / select(direction, vec3f(1e-9), abs(direction) < vec3f(1e-9));
    let t = max((params.box_min.xyz - origin) * inv, (params.box_max.xyz - origin) * inv);
    return min(t.x, min(t.y, t.z));
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_geometry_decoder(lane);
    let ray = linear_invocation(wid, groups, lane);
    if (ray >= params.rays) {
        return;
    }
    let r = rays[ray];
    let n = params.stratified;
    let m = params.surface_samples;
    let near = params.near;
    var far = max(exit_depth(r.origin, r.direction), near + 0.1);
    let guided = (params.flags & FLAG_GUIDED) != 0u && r.depth > 0.0;
    var first = 0.0;
    var last = 0.0;
    if (guided) {
        far = max(r.depth + 1.5 * params.truncation, near + 0.1);
        first = max(r.depth - 1.5 * params.truncation, near);
        last = far;
    }
    let step = (far - near) / f32(n);
    var coarse: array<f32, ${MAX_STRATIFIED}>;
    var cumulative: array<f32, ${MAX_STRATIFIED}>;
    for (var j = 0u; j < n; j++) {
        coarse[j] = near + (f32(j) + jitter(ray, j)) * step;
    }
    var total = 0.0;
    if (!guided) {
        var transmittance = 1.0;
        var previous = 1.0;
        for (var j = 0u; j < n; j++) {
            let s = geometry_decoder(lookup_geometry(r.origin + coarse[j] * r.direction)).distance;
            let here = phi(s);
            if (j > 0u) {
                let alpha = interval_alpha(previous, here);
                total += transmittance * alpha;
                transmittance *= 1.0 - alpha;
            }
            cumulative[j] = total;
            previous = here;
        }
    }
    // Merge the second round into the first, both sorted.
    var i = 0u;
    var interval = 1u;
    let base = ray * params.samples;
    for (var k = 0u; k < m; k++) {
        let u = (f32(k) + jitter(ray, n + k)) / f32(m);
        var z = mix(first, last, u);
        if (!guided) {
            if (total < 1e-2) {
                z = mix(near, far, u);
            } else {
                let target_mass = u * total;
                while (interval < n - 1u && cumulative[interval] < target_mass) {
                    interval++;
                }
                let low = cumulative[interval - 1u];
                let mass = max(cumulative[interval] - low, 1e-9);
                z = mix(coarse[interval - 1u], coarse[interval], clamp((target_mass - low) / mass, 0.0, 1.0));
            }
        }
        while (i < n && coarse[i] <= z) {
            depths[base + i + k] = coarse[i];
            i++;
        }
        depths[base + i + k] = z;
    }
    while (i < n) {
        depths[base + i + m] = coarse[i];
        i++;
    }
}
