// Draws the pixels of a batch and makes their world rays. One invocation per ray.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/random.wgsl
#import shared/rays.wgsl

#bindings

// Rarity of a pixel's class: 0 without a class, -1 without depth.
fn rarity(slot: u32, pixel: u32) -> f32 {
    if (raw_depth(slot, pixel) == 0u) {
        return -1.0;
    }
    let label = color_images[slot * params.width * params.height + pixel] >> 24u;
    if (label >= params.classes) {
        return 0.0;
    }
    return class_rarity[label];
}

fn raw_depth(slot: u32, pixel: u32) -> u32 {
    let stride = (params.width * params.height + 1u) / 2u;
    return (depth_images[slot * stride + pixel / 2u] >> (16u * (pixel & 1u))) & 0xffffu;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let ray = linear_invocation(wid, groups, lane);
    if (ray >= params.rays) {
        return;
    }
    let pixels = params.width * params.height;
    let frame = ray / params.rays_per_frame;
    let slot = window[frame] & 0x7fffffffu;
    var pixel = (params.first + ray) % pixels;
    var raw = 0u;
    if ((params.flags & FLAG_DENSE) == 0u) {
        // A pixel without depth gets one second draw: rays with depth teach more.
        pixel = random_u32(params.seed, params.iteration, ray, ${SALT_PIXEL}u) % pixels;
        raw = raw_depth(slot, pixel);
        if (raw == 0u) {
            pixel = random_u32(params.seed, params.iteration, ray, ${SALT_PIXEL_AGAIN}u) % pixels;
            raw = raw_depth(slot, pixel);
        }
        if (params.classes > 0u && random_f32(params.seed, params.iteration, ray, ${SALT_RARE}u) < params.rare_share) {
            var best = rarity(slot, pixel);
            for (var k = 1u; k < params.rare_draws; k++) {
                let candidate = random_u32(params.seed, params.iteration, ray * 256u + k, ${SALT_RARE_CANDIDATE}u) % pixels;
                let rare = rarity(slot, candidate);
                if (rare > best) {
                    best = rare;
                    pixel = candidate;
                }
            }
            raw = raw_depth(slot, pixel);
        }
    } else if ((params.flags & FLAG_GUIDED) != 0u) {
        raw = raw_depth(slot, pixel);
    }
    let d = vec3f((f32(pixel % params.width) - params.cx) / params.fx, (f32(pixel / params.width) - params.cy) / params.fy, 1.0);
    let b = slot * 12u;
    var out: Ray;
    out.direction = vec3f(
        poses[b] * d.x + poses[b + 1u] * d.y + poses[b + 2u] * d.z,
        poses[b + 3u] * d.x + poses[b + 4u] * d.y + poses[b + 5u] * d.z,
        poses[b + 6u] * d.x + poses[b + 7u] * d.y + poses[b + 8u] * d.z,
    );
    out.origin = vec3f(poses[b + 9u], poses[b + 10u], poses[b + 11u]);
    out.depth = f32(raw) * params.depth_unit;
    out.frame = frame | (slot << 8u);
    // A rendered view may have another size than the stored images: it has no colors to compare with.
    var c = 0xff000000u;
    if ((params.flags & (FLAG_DENSE | FLAG_GUIDED)) != FLAG_DENSE) {
        c = color_images[slot * pixels + pixel];
    }
    out.color = vec3f(f32(c & 255u), f32((c >> 8u) & 255u), f32((c >> 16u) & 255u)) / 255.0;
    out.label = (c >> 24u) | (pixel << 8u);
    // A surface outside the map teaches nothing: mark the ray (top bit of frame) so that no loss uses it.
    let hit = out.origin + out.direction * out.depth;
    let outside = any(hit < params.box_min.xyz) || any(hit > params.box_max.xyz);
    if (outside && (params.flags & FLAG_DENSE) == 0u) {
        out.frame = out.frame | 0x80000000u;
        out.depth = 0.0;
        out.label = out.label | 255u;
    }
    rays[ray] = out;
}
