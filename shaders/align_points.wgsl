// Normal equations of aligning a depth image to the field: one look-up per pixel, at the back-projected point.
// r_s = distance there [m], r_c = intensity of the field minus intensity of the pixel; Geman-McClure weights.
// One invocation per pixel, one row of 32 floats per workgroup:
// 21 upper triangle of J^T W J, 6 J^T W r, sum w r_s^2, sum w r_c^2, points, sum |r_s|, sum |r_c|.
#import shared/planes.wgsl
#import shared/geometry.wgsl
#import shared/geometry_gradient.wgsl
#import shared/appearance.wgsl
#import shared/surface.wgsl

#bindings

const LUMA: vec3f = vec3f(0.299, 0.587, 0.114);
// One float a (sum, lane): 8 KiB, beside the 14 KiB of both decoders too much, so sums are staged 8 at a time.
var<workgroup> stage: array<vec4f, WORKGROUP_SIZE>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_geometry_decoder(lane);
    load_surface_decoders(lane);
    let group = wid.x + wid.y * groups.x;
    let i = group * WORKGROUP_SIZE + lane;
    var sums: array<vec4f, 8>;
    if (i < params.rays) {
        // Camera-frame point [m]; w: intensity of the pixel.
        let q = pixels[i];
        let rotation_row0 = vec3f(poses[0], poses[1], poses[2]);
        let rotation_row1 = vec3f(poses[3], poses[4], poses[5]);
        let rotation_row2 = vec3f(poses[6], poses[7], poses[8]);
        let arm = vec3f(dot(rotation_row0, q.xyz), dot(rotation_row1, q.xyz), dot(rotation_row2, q.xyz));
        let p = arm + vec3f(poses[9], poses[10], poses[11]);
        if (all(p > params.box_min.xyz) && all(p < params.box_max.xyz) && q.z > 0.0) {
            var one = lookup_geometry(p);
            let state = geometry_decoder(one);
            // A saturated distance says only "far": no slope there to follow.
            if (abs(state.distance) < 0.95) {
                let tr = params.truncation;
                let rs = state.distance * tr;
                let gs = lookup_geometry_gradient(p, geometry_feature_gradient(geometry_deltas(state, 1.0))) * tr;
                var f = lookup_appearance(p);
                var h = color_hidden(f);
                let rgb = color_output(h);
                let rc = dot(LUMA, rgb) - q.w;
                let dc = vec4f(LUMA * rgb * (1.0 - rgb), 0.0);
                h = color_hidden_delta(h, dc);
                for (var k = 0u; k < 8u; k++) {
                    f[k] = input_gradient(0u, k, h);
                }
                let gc = lookup_appearance_gradient(p, f);
                let es = rs / params.robust_distance;
                let ec = rc / params.robust_intensity;
                let bs = 1.0 / (1.0 + es * es);
                let bc = 1.0 / (1.0 + ec * ec);
                let ws = params.inv_sigma_distance * params.inv_sigma_distance * bs * bs;
                let wc = params.inv_sigma_intensity * params.inv_sigma_intensity * bc * bc;
                let ms = cross(arm, gs);
                let mc = cross(arm, gc);
                var js = array<f32, 6>(gs.x, gs.y, gs.z, ms.x, ms.y, ms.z);
                var jc = array<f32, 6>(gc.x, gc.y, gc.z, mc.x, mc.y, mc.z);
#for a in 0..6
#for b in a..6
                sums[${(a*(13-a)/2+b-a)/4}][${(a*(13-a)/2+b-a)%4}] = ws * js[${a}] * js[${b}] + wc * jc[${a}] * jc[${b}];
#end
                sums[${(21+a)/4}][${(21+a)%4}] = ws * js[${a}] * rs + wc * jc[${a}] * rc;
#end
                sums[6].w = ws * rs * rs;
                sums[7] = vec4f(wc * rc * rc, 1.0, abs(rs), abs(rc));
            }
        }
    }
#for k in 0..8
    stage[lane] = sums[${k}];
    workgroupBarrier();
    if (lane < 4u) {
        var total = 0.0;
        for (var j = 0u; j < WORKGROUP_SIZE; j++) {
            total += stage[j][lane];
        }
        partials[group * 32u + ${k*4}u + lane] = total;
    }
    workgroupBarrier();
#end
}
