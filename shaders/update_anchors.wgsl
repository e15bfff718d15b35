// Anchors follow the features matched to them (paper eqs. 11, 12). One workgroup per anchor.
#import shared/rays.wgsl
#import shared/lane_sums.wgsl

#bindings

var<workgroup> labels: array<atomic<u32>, 256>;
// The class with most votes of each lane's.
var<workgroup> most: array<f32, 64>;
var<workgroup> winner: array<u32, 64>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let at = wid.x * ${ANCHOR_VEC4}u;
    let alive = bitcast<u32>(anchors[at + 4u].x) != 255u;
    for (var c = lane; c < 256u; c += 64u) {
        atomicStore(&labels[c], 0u);
    }
    workgroupBarrier();
    var sum: array<vec4f, 4>;
    var count = 0.0;
    if (alive) {
        for (var ray = lane; ray < params.rays; ray += 64u) {
            let state = ray * ${RAY_STATE_VEC4}u;
            if (bitcast<u32>(ray_state[state + ${STATE_ANCHOR}u].x) != wid.x || (rays[ray].frame & 0x80000000u) != 0u) {
                continue;
            }
            count += 1.0;
            atomicAdd(&labels[rays[ray].label & 255u], 1u);
#for j in 0..4
            sum[${j}] += ray_state[state + ${STATE_FEATURE+j}u];
#end
        }
    }
    sum_lanes(lane, sum, count);
    var best = 0.0;
    var class_id = bitcast<u32>(anchors[at + 4u].x);
    if (alive) {
        for (var c = lane; c < params.classes; c += 64u) {
            let v = votes[wid.x * params.classes + c] * params.decay + f32(atomicLoad(&labels[c]));
            votes[wid.x * params.classes + c] = v;
            if (v > best) {
                best = v;
                class_id = c;
            }
        }
    }
    most[lane] = best;
    winner[lane] = class_id;
    workgroupBarrier();
    if (lane != 0u || !alive) {
        return;
    }
    // Of equals the first class.
    for (var k = 1u; k < 64u; k++) {
        if (most[k] > best || (most[k] == best && best > 0.0 && winner[k] < class_id)) {
            best = most[k];
            class_id = winner[k];
        }
    }
    count = lane_weights[0];
    var info = anchors[at + 4u];
    var moved = 0.0;
    if (count > 0.0) {
        let rate = select(1.0 - pow(1.0 - params.beta, count), count / (info.y + count), params.rule == 1u);
#for j in 0..4
        let step${j} = rate * (lane_features[${j}][0] / count - anchors[at + ${j}u]);
        moved += dot(step${j}, step${j});
        anchors[at + ${j}u] += step${j};
#end
    }
    info.y = min(info.y + count, params.memory);
    info.z = info.z * params.decay + count;
    info.w = info.w * params.variation_decay + (1.0 - params.variation_decay) * sqrt(moved);
    info.x = bitcast<f32>(class_id);
    anchors[at + 4u] = info;
    anchors[at + 5u].x += 1.0;
}
