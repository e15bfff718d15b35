// Anchors settle where the nearest one gives the head's class: generalised learning vector quantisation. One workgroup per anchor.
#import shared/rays.wgsl
#import shared/head.wgsl
#import shared/lane_sums.wgsl

#bindings

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let at = wid.x * ${ANCHOR_VEC4}u;
    let alive = bitcast<u32>(anchors[at + 4u].x) != 255u;
    var sum: array<vec4f, 4>;
    var weight = 0.0;
    if (alive) {
        for (var ray = lane; ray < params.rays; ray += 64u) {
            let state = ray * ${RAY_STATE_VEC4}u;
            let matched = ray_state[state + ${STATE_ANCHOR}u];
            let own = bitcast<u32>(matched.x);
            let rival = bitcast<u32>(matched.y);
            if ((own != wid.x && rival != wid.x) || own == ${NO_ANCHOR}u || rival == ${NO_ANCHOR}u || (rays[ray].frame & 0x80000000u) != 0u) {
                continue;
            }
            // The own anchor comes by the rival's distance, the rival goes by the own one's: both the more, the closer to a mistake.
            let total = max(matched.z + matched.w, 1e-12);
            let mistaken = 1.0 / (1.0 + exp(min(params.slope * (matched.w - matched.z) / total, 80.0)));
            let w = mistaken * select(-matched.z, matched.w, own == wid.x) / total;
            weight += abs(w);
#for j in 0..4
            sum[${j}] += w * (ray_state[state + ${STATE_FEATURE+j}u] - anchors[at + ${j}u]);
#end
        }
    }
    sum_lanes(lane, sum, weight);
    if (lane != 0u || !alive) {
        return;
    }
    let step = select(0.0, params.rate / max(lane_weights[0], 1e-12), lane_weights[0] > 0.0);
    var vector: array<vec4f, 4>;
#for j in 0..4
    vector[${j}] = anchors[at + ${j}u] + step * lane_features[${j}][0];
#end
    // It stays where the step would make it another class's: no class loses its last anchor.
    let class_id = likeliest_class(vector);
    if (params.rays > 0u && class_id != bitcast<u32>(anchors[at + 4u].x)) {
        return;
    }
#for j in 0..4
    anchors[at + ${j}u] = vector[${j}];
#end
    anchors[at + 4u].x = bitcast<f32>(class_id);
}
