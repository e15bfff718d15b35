// Class logits of the samples composited along the ray, the ray's class and cross-entropy, and the gradients at the
// samples' logits, which take their place. One workgroup per ray, one invocation every 64th class.
#import shared/dispatch.wgsl
#import shared/rays.wgsl

#bindings

var<workgroup> composited: array<f32, 256>;
// Largest logit, sum of exponentials, factor of the gradient.
var<workgroup> statistics: array<f32, 3>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let part_ray = linear_workgroup(wid, groups);
    if (part_ray >= params.rays) {
        return;
    }
    let ray = params.first_ray + part_ray;
    let first = part_ray * params.slots * params.classes;
    let weights = ray * params.slots;
    for (var c = lane; c < params.classes; c += WORKGROUP_SIZE) {
        var sum = 0.0;
        for (var s = 0u; s < params.slots; s++) {
            sum += slot_weights[weights + s] * logits[first + s * params.classes + c];
        }
        composited[c] = sum;
    }
    workgroupBarrier();
    let masked = (rays[ray].frame & 0x80000000u) != 0u;
    let label = ray_class(rays[ray]);
    if (lane == 0u) {
        var best_logit = -1e30;
        var best = -1e30;
        var best_class = 255u;
        var sum = 0.0;
        for (var c = 0u; c < params.classes; c++) {
            if (composited[c] > best_logit) {
                best_logit = composited[c];
                best_class = c;
            }
            let v = composited[c] + class_weights[c].y;
            composited[c] = v;
            if (v > best) {
                sum = sum * exp(best - v) + 1.0;
                best = v;
            } else {
                sum += exp(v - best);
            }
        }
        var loss = 0.0;
        var scale = 0.0;
        if (label < params.classes && !masked) {
            let weight = class_weights[label].x;
            loss = weight * (log(sum) + best - composited[label]);
            scale = weight * params.weight_semantic / f32(params.batch_rays);
        }
        ray_out[ray * 12u + 5u] = best_class;
        ray_out[ray * 12u + 8u] = bitcast<u32>(loss);
        statistics[0] = best;
        statistics[1] = sum;
        statistics[2] = scale;
    }
    workgroupBarrier();
    if (params.train == 0u) {
        return;
    }
    for (var c = lane; c < params.classes; c += WORKGROUP_SIZE) {
        let p = exp(composited[c] - statistics[0]) / statistics[1];
        let g = statistics[2] * (p - select(0.0, 1.0, c == label));
        for (var s = 0u; s < params.slots; s++) {
            logits[first + s * params.classes + c] = slot_weights[weights + s] * g;
        }
    }
}
