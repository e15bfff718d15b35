// Decoders and class head on composited features, their losses, and the gradients back to the features.
// One invocation per ray. Color 32-32-3 with sigmoid, semantic feature 32-32-16, class head 16-C linear.
#import shared/dispatch.wgsl
#import shared/flags.wgsl
#import shared/rays.wgsl
#import shared/surface.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_surface_decoders(lane);
    let ray = linear_invocation(wid, groups, lane);
    if (ray >= params.rays) {
        return;
    }
    let r = rays[ray];
    let masked = (r.frame & 0x80000000u) != 0u;
    let inv_rays = 1.0 / f32(params.rays);
    let state = ray * ${RAY_STATE_VEC4}u;
    var f: array<vec4f, 8>;
#for q in 0..8
    f[${q}] = ray_state[state + ${STATE_APPEARANCE+q}u];
#end
    var hc = color_hidden(f);
    let rgb = color_output(hc);
    let geometry = ray_state[state + ${STATE_DEPTH}u];

    // Color: mean squared error over the three channels, on rays that meet a surface.
    let difference = select(rgb - r.color, vec3f(0.0), masked);
    let loss_color = dot(difference, difference) / 3.0;
    let drgb = difference * (2.0 / 3.0 * params.weight_color * inv_rays);
    let dc = vec4f(drgb * rgb * (1.0 - rgb), 0.0);
    let delta = color_hidden_delta(hc, dc);
#for q in 0..8
    ray_state[state + ${STATE_COLOR_HIDDEN+q}u] = hc[${q}];
#end
    hc = delta;
#for q in 0..8
    ray_state[state + ${STATE_COLOR_HIDDEN_DELTA+q}u] = hc[${q}];
#end
    ray_state[state + ${STATE_COLOR_DELTA}u] = dc;
    for (var q = 0u; q < 8u; q++) {
        ray_state[state + ${STATE_APPEARANCE_GRADIENT}u + q] = input_gradient(0u, q, hc);
    }

    // Depth: squared error on rays with a sensor depth. Its gradient is stored unweighted by the interval.
    var loss_depth = 0.0;
    var ddepth = 0.0;
    if (r.depth > 0.0) {
        let e = geometry.x - r.depth;
        loss_depth = e * e;
        ddepth = 2.0 * e * params.weight_depth * inv_rays;
    }
    ray_state[state + ${STATE_DEPTH}u] = vec4f(geometry.xy, ddepth, geometry.w);

    // Semantics: cross-entropy at the class head; the gradient stops at the interval weights.
    var loss_semantic = 0.0;
    var best_class = 255u;
    if (params.classes > 0u) {
#for q in 0..8
        f[${q}] = ray_state[state + ${STATE_SEMANTIC+q}u];
#end
        let label = ray_class(r);
        var hs = semantic_hidden(f);
        var feature = semantic_output(hs);
        // The cross-entropy sees logits that favour classes as the weights do, so that the logits themselves, and the
        // classes by them, need not.
        var best_logit = -1e30;
        var best = -1e30;
        var sum = 0.0;
        var own = 0.0;
        for (var c = 0u; c < params.classes; c++) {
            let plain = class_logit(feature, c);
            if (plain > best_logit) {
                best_logit = plain;
                best_class = c;
            }
            let logit = plain + class_weights[c].y;
            if (logit > best) {
                sum = sum * exp(best - logit) + 1.0;
                best = logit;
            } else {
                sum += exp(logit - best);
            }
            own = select(own, logit, c == label);
        }
        // Nearest anchor (paper eq. 9).
        var nearest = ${NO_ANCHOR}u;
        var distance = 1e30;
        var own_distance = 1e30;
        var own_nearest = ${NO_ANCHOR}u;
        for (var a = 0u; a < params.anchors; a++) {
            let at = a * ${ANCHOR_VEC4}u;
            let class_id = bitcast<u32>(anchors[at + 4u].x);
            if (class_id == 255u) {
                continue;
            }
            var d = 0.0;
#for j in 0..4
            let e${j} = feature[${j}] - anchors[at + ${j}u];
            d += dot(e${j}, e${j});
#end
            if (d < distance) {
                nearest = a;
                distance = d;
            }
            if (class_id == label && d < own_distance) {
                own_nearest = a;
                own_distance = d;
            }
        }
        // The token of the ray's pixel, for its fused feature.
        let fused = params.token_columns > 0u && (params.weight_feature > 0.0 || params.doubt_fused > 0.0);
        var token = 0u;
        if (fused) {
            let pixel = r.label >> 8u;
            let slot = (r.frame & 0x7fffffffu) >> 8u;
            let column = min(pixel % params.width / params.token_size, params.token_columns - 1u);
            let row = min(pixel / params.width / params.token_size, params.token_rows - 1u);
            token = ((slot * params.token_rows + row) * params.token_columns + column) * ${TARGET_VEC4}u;
        }
        let labelled = label < params.classes;
        var df: array<vec4f, 4>;
        var class_weight = 0.0;
        var trust = 1.0;
        if (labelled) {
            // What anchors doubt, the fused feature may vouch for.
            let by_anchors = params.doubt_anchor > 0.0 && own_nearest != ${NO_ANCHOR}u;
            var doubt = 0.0;
            if (by_anchors) {
                doubt = 1.0 - exp(params.doubt_anchor * (distance - own_distance));
            }
            if (fused && params.doubt_fused > 0.0) {
                var aim: array<vec4f, 4>;
#for j in 0..4
                aim[${j}] = targets[token + ${j}u];
#end
                let gap = min(class_logit(aim, label) - targets[token + 4u].y, 0.0);
                let fits = exp(params.doubt_fused * gap);
                let weight = targets[token + 4u].x;
                doubt = select(weight * (1.0 - fits), doubt * (1.0 - weight * fits), by_anchors);
            }
            trust = 1.0 - doubt;
            class_weight = class_weights[label].x * trust;
            loss_semantic = class_weight * (log(sum) + best - own);
        }
        let scale = class_weight * params.weight_semantic * inv_rays;
        for (var c = 0u; c < params.classes; c++) {
            let p = exp(class_logit(feature, c) + class_weights[c].y - best) / sum;
            let g = scale * (p - select(0.0, 1.0, c == label));
            logits_gradient[ray * params.classes + c] = g;
#for j in 0..4
            df[${j}] += g * decoders[${HEAD_VEC4+j}u + c * 4u];
#end
        }
        if ((params.flags & FLAG_ANCHORS) != 0u && nearest != ${NO_ANCHOR}u) {
            let at = nearest * ${ANCHOR_VEC4}u;
            best_class = likeliest_class(array<vec4f, 4>(anchors[at], anchors[at + 1u], anchors[at + 2u], anchors[at + 3u]));
        }
        var loss_feature = 0.0;
        if (!masked && params.weight_compression > 0.0 && nearest != ${NO_ANCHOR}u) {
            // A feature much further from its label's anchor than from the nearest is taken for mislabelled.
            let own = own_distance < 4.0 * distance;
            let at = select(nearest, own_nearest, own) * ${ANCHOR_VEC4}u;
#for j in 0..4
            df[${j}] += 2.0 * params.weight_compression * inv_rays * (feature[${j}] - anchors[at + ${j}u]);
#end
            loss_feature += params.weight_compression * select(distance, own_distance, own);
        }
        // The fused feature of the pixel's token is the target of the feature loss.
        if (!masked && fused) {
            // With doubts, the fused feature teaches what the label is not trusted to.
            let weight = params.weight_feature * targets[token + 4u].x * select(1.0, 1.0 - trust, params.doubt_fused > 0.0);
#for j in 0..4
            let t${j} = feature[${j}] - targets[token + ${j}u];
            df[${j}] += 2.0 * weight * inv_rays * t${j};
            loss_feature += weight * dot(t${j}, t${j});
#end
        }
        ray_state[state + ${STATE_ANCHOR}u] = vec4f(bitcast<f32>(nearest), distance, own_distance, loss_feature);
#for j in 0..4
        ray_state[state + ${STATE_FEATURE+j}u] = feature[${j}];
        ray_state[state + ${STATE_FEATURE_DELTA+j}u] = df[${j}];
#end
        for (var q = 0u; q < 8u; q++) {
            let w = 561u + q * 16u;
            let t = vec4f(dot4(w, df), dot4(w + 4u, df), dot4(w + 8u, df), dot4(w + 12u, df));
            ray_state[state + ${STATE_SEMANTIC_HIDDEN}u + q] = hs[q];
            hs[q] = select(vec4f(0.0), t, hs[q] > vec4f(0.0));
            ray_state[state + ${STATE_SEMANTIC_HIDDEN_DELTA}u + q] = hs[q];
        }
        for (var q = 0u; q < 8u; q++) {
            ray_state[state + ${STATE_SEMANTIC_GRADIENT}u + q] = input_gradient(${SEMANTIC_W1}u, q, hs);
        }
    }
    let out = ray * 3u;
    let depth_error = select(0.0, abs(geometry.x - r.depth), r.depth > 0.0);
    ray_out[out] = vec4f(rgb, geometry.x);
    ray_out[out + 1u] = vec4f(geometry.y, bitcast<f32>(best_class), loss_color, loss_depth);
    ray_out[out + 2u] = vec4f(loss_semantic, 0.0, depth_error, 0.0);
}
