// Adds feature gradients into the appearance and semantic planes, fixed point. All samples of a ray share one
// gradient (features are composited before decoding), so per cell only four scalars are summed.
// One invocation per (ray, modality, level, plane, channel quad).
#import shared/dispatch.wgsl
#import shared/rays.wgsl
#import shared/planes.wgsl

#bindings

fn add(modality: u32, cell: u32, quad: u32, v: vec4f) {
    let limited = clamp(v, vec4f(-params.contribution_limit), vec4f(params.contribution_limit));
    if (any(limited != v)) {
        atomicOr(&status[0], 1u);
    }
    let q = vec4<i32>(round(limited));
    let i = cell * 16u + quad * 4u;
    if (all(q == vec4<i32>(0))) {
        return;
    }
    if (modality == 0u) {
        atomicAdd(&gradient_appearance[i], q.x);
        atomicAdd(&gradient_appearance[i + 1u], q.y);
        atomicAdd(&gradient_appearance[i + 2u], q.z);
        atomicAdd(&gradient_appearance[i + 3u], q.w);
    } else {
        atomicAdd(&gradient_semantic[i], q.x);
        atomicAdd(&gradient_semantic[i + 1u], q.y);
        atomicAdd(&gradient_semantic[i + 2u], q.z);
        atomicAdd(&gradient_semantic[i + 3u], q.w);
    }
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let job = linear_invocation(wid, groups, lane);
    if (job >= params.rays * 48u) {
        return;
    }
    let quad = job % 4u;
    let ray = (job / 4u) % params.rays;
    let part = job / (4u * params.rays);
    let plane = part % 3u;
    let level = (part / 3u) % 2u;
    let modality = part / 6u;
    if ((rays[ray].frame & 0x80000000u) != 0u) {
        return;
    }
    if (modality == 0u && params.weight_color == 0.0) {
        return;
    }
    let unlabelled = ray_class(rays[ray]) >= params.classes && params.weight_compression == 0.0 && params.weight_feature == 0.0;
    if (modality == 1u && (params.classes == 0u || unlabelled)) {
        return;
    }
    let inv = params.surface_inv_cell[level];
    let grid = select(params.surface_coarse, params.surface_fine, level == 1u);
    let scale = select(params.scale_appearance, params.scale_semantic, modality == 1u);
    let state = ray * ${RAY_STATE_VEC4}u + level * 4u
        + select(${STATE_APPEARANCE_GRADIENT}u, ${STATE_SEMANTIC_GRADIENT}u, modality == 1u);
    let g = ray_state[state + quad] * scale;
    let base = ray * params.samples;
    let origin = (rays[ray].origin - params.box_min.xyz) * inv;
    let direction = rays[ray].direction * inv;
    var held = vec4<u32>(0xffffffffu);
    var sum = vec4f(0.0);
    let range = u32(ray_state[ray * ${RAY_STATE_VEC4}u + ${STATE_DEPTH}u].w);
    let end = range % 256u;
    var i = range / 256u;
    loop {
        while (i < end && weights[base + i] <= params.min_weight) {
            i++;
        }
        if (i >= end) {
            break;
        }
        let w = weights[base + i];
        let z = 0.5 * (depths[base + i] + depths[base + i + 1u]);
        let c = plane_corners(plane, origin + z * direction, grid);
        if (c.cell.x != held.x) {
            if (held.x != 0xffffffffu) {
                add(modality, held.x, quad, g * sum.x);
                add(modality, held.y, quad, g * sum.y);
                add(modality, held.z, quad, g * sum.z);
                add(modality, held.w, quad, g * sum.w);
            }
            held = c.cell;
            sum = vec4f(0.0);
        }
        sum += c.weight * w;
        i++;
    }
    if (held.x != 0xffffffffu) {
        add(modality, held.x, quad, g * sum.x);
        add(modality, held.y, quad, g * sum.y);
        add(modality, held.z, quad, g * sum.z);
        add(modality, held.w, quad, g * sum.w);
    }
}
