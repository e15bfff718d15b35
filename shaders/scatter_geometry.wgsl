// Adds feature gradients into the geometry planes, fixed point. One invocation per (ray, level, plane, channel
// quad): samples of the ray that share a cell are summed first, so that a cell costs 16 atomics, not 16 per sample.
#import shared/dispatch.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl

#bindings

fn add(cell: u32, quad: u32, v: vec4f) {
    let scaled = v * params.scale_geometry;
    let limited = clamp(scaled, vec4f(-params.contribution_limit), vec4f(params.contribution_limit));
    if (any(limited != scaled)) {
        atomicOr(&status[0], 1u);
    }
    let q = vec4<i32>(round(limited));
    let i = cell * 16u + quad * 4u;
    if (any(q != vec4<i32>(0))) {
        atomicAdd(&gradient[i], q.x);
        atomicAdd(&gradient[i + 1u], q.y);
        atomicAdd(&gradient[i + 2u], q.z);
        atomicAdd(&gradient[i + 3u], q.w);
    }
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = linear_invocation(wid, groups, lane);
    if (job >= params.rays * 24u) {
        return;
    }
    // Quads innermost: they share every branch, and their atomics lie side by side.
    let quad = job % 4u;
    let ray = (job / 4u) % params.rays;
    let part = job / (4u * params.rays);
    let plane = part % 3u;
    let level = part / 3u;
    let inv = params.geometry_inv_cell[level];
    let grid = select(params.geometry_coarse, params.geometry_fine, level == 1u);
    let base = ray * params.samples;
    let origin = (rays[ray].origin - params.box_min.xyz) * inv;
    let direction = rays[ray].direction * inv;
    var held = vec4<u32>(0xffffffffu);
    var a0 = vec4f(0.0);
    var a1 = vec4f(0.0);
    var a2 = vec4f(0.0);
    var a3 = vec4f(0.0);
    var i = 0u;
    loop {
        // Skipping in a loop of its own lets each lane go on to its next sample (see composite).
        while (i < params.samples && distance_gradient[base + i] == 0.0) {
            i++;
        }
        if (i >= params.samples) {
            break;
        }
        let v = features[(base + i) * 8u + level * 4u + quad];
        let c = plane_corners(plane, origin + depths[base + i] * direction, grid);
        if (c.cell.x != held.x) {
            if (held.x != 0xffffffffu) {
                add(held.x, quad, a0);
                add(held.y, quad, a1);
                add(held.z, quad, a2);
                add(held.w, quad, a3);
            }
            held = c.cell;
            a0 = vec4f(0.0);
            a1 = vec4f(0.0);
            a2 = vec4f(0.0);
            a3 = vec4f(0.0);
        }
        a0 += c.weight.x * v;
        a1 += c.weight.y * v;
        a2 += c.weight.z * v;
        a3 += c.weight.w * v;
        i++;
    }
    if (held.x != 0xffffffffu) {
        add(held.x, quad, a0);
        add(held.y, quad, a1);
        add(held.z, quad, a2);
        add(held.w, quad, a3);
    }
}
