// Drops unimportant anchors, merges stable duplicates, spawns anchors for features far from their class's.
// One workgroup, a lane for each anchor: the decisions are in order, their searches parallel.
#import shared/rays.wgsl

#bindings

const FREE: u32 = 255u;
const NONE: u32 = 0xffffffffu;
// Classes of the anchors; anchors of each class.
var<workgroup> class_at: array<u32, 256>;
var<workgroup> of_class: array<u32, 256>;
// 1: the anchor may go, or merge.
var<workgroup> marked: array<u32, 256>;
var<workgroup> best_value: array<f32, WORKGROUP_SIZE>;
var<workgroup> best_index: array<u32, WORKGROUP_SIZE>;
var<workgroup> other: u32;

fn clear(i: u32) {
    for (var k = 0u; k < ${ANCHOR_VEC4}u; k++) {
        anchors[i * ${ANCHOR_VEC4}u + k] = vec4f(0.0);
    }
    anchors[i * ${ANCHOR_VEC4}u + 4u].x = bitcast<f32>(FREE);
    for (var c = 0u; c < params.classes; c++) {
        votes[i * params.classes + c] = 0.0;
    }
    of_class[class_at[i]] -= 1u;
    of_class[FREE] += 1u;
    class_at[i] = FREE;
    marked[i] = 0u;
}
// More labels than not agree, and not by a single one.
fn borne_out(class_id: u32) -> bool {
    return params.supported == 0u || class_support[2u * class_id] > class_support[2u * class_id + 1u] + 1u;
}
fn feature_distance(ray: u32, i: u32) -> f32 {
    var d = 0.0;
#for j in 0..4
    let e${j} = ray_state[ray * ${RAY_STATE_VEC4}u + ${STATE_FEATURE+j}u] - anchors[i * ${ANCHOR_VEC4}u + ${j}u];
    d += dot(e${j}, e${j});
#end
    return d;
}
// Uniform value of a workgroup variable.
fn shared_other() -> u32 {
    return workgroupUniformLoad(&other);
}
// The pair of duplicates next in order, 256 i + j, of those with anchor i; from `cursor` on.
fn next_duplicate(i: u32, cursor: u32) -> u32 {
    if (i >= params.anchors || i < cursor / 256u || marked[i] == 0u) {
        return NONE;
    }
    for (var j = max(i + 1u, select(0u, cursor % 256u, i == cursor / 256u)); j < params.anchors; j++) {
        if (marked[j] == 0u || class_at[j] != class_at[i]) {
            continue;
        }
        var d = 0.0;
        for (var k = 0u; k < 4u; k++) {
            let e = anchors[i * ${ANCHOR_VEC4}u + k] - anchors[j * ${ANCHOR_VEC4}u + k];
            d += dot(e, e);
        }
        if (d < params.merge_distance) {
            return i * 256u + j;
        }
    }
    return NONE;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(local_invocation_index) lane: u32) {
    // One lane per anchor.
    let mine = lane * ${ANCHOR_VEC4}u;
    class_at[lane] = FREE;
    marked[lane] = 0u;
    of_class[lane] = 0u;
    if (lane < params.anchors) {
        class_at[lane] = min(bitcast<u32>(anchors[mine + 4u].x), FREE);
        let unimportant = anchors[mine + 5u].x >= params.min_age && anchors[mine + 4u].z < params.min_importance;
        marked[lane] = select(0u, 1u, class_at[lane] != FREE && unimportant);
    }
    workgroupBarrier();
    if (lane == 0u) {
        for (var i = 0u; i < params.anchors; i++) {
            of_class[class_at[i]] += 1u;
        }
        // Unimportant anchors go, but never the last of a class.
        for (var i = 0u; i < params.anchors; i++) {
            if (marked[i] != 0u && of_class[class_at[i]] > 1u) {
                clear(i);
                anchor_counts[2] += 1u;
            }
        }
    }
    storageBarrier();
    workgroupBarrier();

    // Stable duplicates become one, weighted by their matches: for each anchor its next duplicate, until there is none.
    if (lane < params.anchors) {
        let stable = anchors[mine + 5u].x >= params.min_age && anchors[mine + 4u].w < params.stable;
        marked[lane] = select(0u, 1u, class_at[lane] != FREE && stable);
    }
    workgroupBarrier();
    for (var cursor = 0u; cursor != NONE;) {
        best_index[lane] = next_duplicate(lane, cursor);
        workgroupBarrier();
        if (lane == 0u) {
            var pair = NONE;
            for (var k = 0u; k < params.anchors; k++) {
                pair = min(pair, best_index[k]);
            }
            other = pair;
            if (pair != NONE) {
                let i = pair / 256u;
                let j = pair % 256u;
                let a = i * ${ANCHOR_VEC4}u;
                let b = j * ${ANCHOR_VEC4}u;
                let total = anchors[a + 4u].y + anchors[b + 4u].y;
                let share = anchors[b + 4u].y / max(total, 1.0);
                for (var k = 0u; k < 4u; k++) {
                    anchors[a + k] += share * (anchors[b + k] - anchors[a + k]);
                }
                anchors[a + 4u].y = total;
                anchors[a + 4u].z += anchors[b + 4u].z;
                for (var c = 0u; c < params.classes; c++) {
                    votes[i * params.classes + c] += votes[j * params.classes + c];
                }
                clear(j);
                anchor_counts[3] += 1u;
                other = pair + 1u;
            }
        }
        storageBarrier();
        cursor = shared_other();
    }

    // A feature far from its class's anchors becomes one; classes without any come first.
    for (var round = 0u; round < params.spawns; round++) {
        var furthest = params.spawn_distance;
        var chosen = NONE;
        for (var ray = lane; ray < params.rays; ray += WORKGROUP_SIZE) {
            let class_id = ray_class(rays[ray]);
            if ((rays[ray].frame & 0x80000000u) != 0u || class_id >= params.classes || !borne_out(class_id)) {
                continue;
            }
            let match_state = ray_state[ray * ${RAY_STATE_VEC4}u + ${STATE_ANCHOR}u];
            let is_first = of_class[class_id] == 0u;
            let own = select(match_state.z, 1e30, is_first);
            if (own > furthest && (is_first || match_state.y > params.merge_distance)) {
                furthest = own;
                chosen = ray;
            }
        }
        best_value[lane] = furthest;
        best_index[lane] = chosen;
        workgroupBarrier();
        // The furthest, of equals the first ray.
        for (var half = WORKGROUP_SIZE / 2u; half > 0u; half /= 2u) {
            if (lane < half) {
                let k = lane + half;
                if (best_index[k] != NONE && (best_value[k] > best_value[lane] || best_index[lane] == NONE
                    || (best_value[k] == best_value[lane] && best_index[k] < best_index[lane]))) {
                    best_value[lane] = best_value[k];
                    best_index[lane] = best_index[k];
                }
            }
            workgroupBarrier();
        }
        if (lane == 0u) {
            var slot = 0u;
            while (slot < params.anchors && class_at[slot] != FREE) {
                slot++;
            }
            other = NONE;
            let ray = best_index[0];
            // Full: a class without any anchor takes the place of the least important one that is not its class's last.
            if (slot == params.anchors && ray != NONE && of_class[ray_class(rays[ray])] == 0u) {
                var least = 1e30;
                for (var i = 0u; i < params.anchors; i++) {
                    let importance = anchors[i * ${ANCHOR_VEC4}u + 4u].z;
                    if (of_class[class_at[i]] > 1u && importance < least) {
                        least = importance;
                        slot = i;
                    }
                }
                anchor_counts[2] += select(0u, 1u, slot < params.anchors);
            }
            if (slot < params.anchors && ray != NONE) {
                other = slot;
                let a = slot * ${ANCHOR_VEC4}u;
                let class_id = ray_class(rays[ray]);
                clear(slot);
                for (var k = 0u; k < 4u; k++) {
                    anchors[a + k] = ray_state[ray * ${RAY_STATE_VEC4}u + ${STATE_FEATURE}u + k];
                }
                anchors[a + 4u] = vec4f(bitcast<f32>(class_id), 1.0, params.min_importance, 2.0 * params.stable);
                votes[slot * params.classes + class_id] = 1.0;
                class_at[slot] = class_id;
                of_class[class_id] += 1u;
                of_class[FREE] -= 1u;
                anchor_counts[1] += 1u;
            }
        }
        storageBarrier();
        let slot = shared_other();
        if (slot == NONE) {
            break;
        }
        for (var ray = lane; ray < params.rays; ray += WORKGROUP_SIZE) {
            let d = feature_distance(ray, slot);
            let at = ray * ${RAY_STATE_VEC4}u + ${STATE_ANCHOR}u;
            ray_state[at].y = min(ray_state[at].y, d);
            if (ray_class(rays[ray]) == class_at[slot]) {
                ray_state[at].z = min(ray_state[at].z, d);
            }
        }
        workgroupBarrier();
    }
    if (lane == 0u) {
        anchor_counts[0] = params.anchors - of_class[FREE];
    }
}
