// Raw features of each 8 x 8 sampled patch: geometry encoding, colors, class histogram. One invocation per token.
#import shared/angle.wgsl
#import shared/dispatch.wgsl
#import shared/tokens.wgsl

#bindings

fn color(u: u32, v: u32) -> u32 {
    return color_images[(params.slot * params.height + v) * params.width + u];
}
fn depth(u: u32, v: u32) -> f32 {
    let pixel = v * params.width + u;
    let word = depth_images[params.slot * ((params.width * params.height + 1u) / 2u) + pixel / 2u];
    return f32((word >> (16u * (pixel & 1u))) & 0xffffu) * params.depth_unit;
}
fn point(u: u32, v: u32) -> vec3f {
    let z = depth(u, v);
    return vec3f((f32(u) - params.cx) / params.fx * z, (f32(v) - params.cy) / params.fy * z, z);
}
fn rotate(d: vec3f) -> vec3f {
    let b = params.slot * 12u;
    return vec3f(
        poses[b] * d.x + poses[b + 1u] * d.y + poses[b + 2u] * d.z,
        poses[b + 3u] * d.x + poses[b + 4u] * d.y + poses[b + 5u] * d.z,
        poses[b + 6u] * d.x + poses[b + 7u] * d.y + poses[b + 8u] * d.z,
    );
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let token = linear_invocation(wid, groups, lane);
    if (token >= params.columns * params.rows) {
        return;
    }
    let out = token * params.raw_stride;
    let u0 = token % params.columns * params.size;
    let v0 = token / params.columns * params.size;

    // The measured pixel closest to the middle stands for the patch's geometry.
    let step = params.size / 8u;
    var nearest = 1000.0;
    var at_u = 0u;
    var at_v = 0u;
    var mean = vec3f(0.0);
    for (var k = 0u; k < 64u; k++) {
        let i = k % 8u;
        let j = k / 8u;
        let u = u0 + i * step;
        let v = v0 + j * step;
        let x = f32(i) - 3.5;
        let y = f32(j) - 3.5;
        let away = x * x + y * y;
        if (depth(u, v) > 0.0 && away < nearest) {
            nearest = away;
            at_u = u;
            at_v = v;
        }
        let c = color(u, v);
        let rgb = vec3f(f32(c & 255u), f32((c >> 8u) & 255u), f32((c >> 16u) & 255u)) / 255.0;
        raw[out + ${RAW_PATCH}u + k * 3u] = rgb.x - 0.5;
        raw[out + ${RAW_PATCH}u + k * 3u + 1u] = rgb.y - 0.5;
        raw[out + ${RAW_PATCH}u + k * 3u + 2u] = rgb.z - 0.5;
        mean += rgb / 64.0;
    }
    raw[out + ${RAW_MEAN}u] = mean.x;
    raw[out + ${RAW_MEAN+1}u] = mean.y;
    raw[out + ${RAW_MEAN+2}u] = mean.z;
    let valid = nearest < 1000.0;
    raw[out + ${RAW_MEAN+3}u] = 0.0;
    for (var k = 0u; k < 3u; k++) {
        raw[out + ${RAW_POINT}u + k] = 0.0;
    }
    raw[out + ${RAW_POINT+3}u] = select(0.0, 1.0, valid);
    for (var k = 0u; k < ${RAW_PATCH}u; k++) {
        raw[out + k] = 0.0;
    }
    if (valid) {
        let b = params.slot * 12u + 9u;
        let world = rotate(point(at_u, at_v)) + vec3f(poses[b], poses[b + 1u], poses[b + 2u]) - params.box_min.xyz;
        let l = point(max(at_u, 2u) - 2u, at_v);
        let r = point(min(at_u + 2u, params.width - 1u), at_v);
        let a = point(at_u, max(at_v, 2u) - 2u);
        let d = point(at_u, min(at_v + 2u, params.height - 1u));
        if (l.z > 0.0 && r.z > 0.0 && a.z > 0.0 && d.z > 0.0) {
            // Towards the camera.
            let n = cross(d - a, r - l);
            let size = sqrt(dot(n, n));
            if (size > 0.0) {
                let w = rotate(n / size);
                raw[out] = w.x;
                raw[out + 1u] = w.y;
                raw[out + 2u] = w.z;
            }
        }
        for (var k = 0u; k < 3u; k++) {
            raw[out + ${RAW_POINT}u + k] = world[k] + params.box_min[k];
            raw[out + 3u + k] = world[k] / 8.0 - 0.5;
            var angle = world[k] * (3.14159265 / 8.0);
            for (var band = 0u; band < ${BANDS}u; band++) {
                let to = out + 6u + band * 6u + k;
                let wave = sin_cos(angle);
                raw[to] = wave.x;
                raw[to + 3u] = wave.y;
                angle *= 2.0;
            }
        }
    }

    for (var c = 0u; c < (params.classes + 3u) / 4u * 4u; c++) {
        raw[out + ${RAW_HISTOGRAM}u + c] = 0.0;
    }
    let one = 1.0 / f32(params.size * params.size);
    for (var k = 0u; k < params.size * params.size; k++) {
        let class_id = color(u0 + k % params.size, v0 + k / params.size) >> 24u;
        if (class_id < params.classes) {
            raw[out + ${RAW_HISTOGRAM}u + class_id] += one;
        }
    }
}
