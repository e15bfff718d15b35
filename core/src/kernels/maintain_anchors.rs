//! Drops, merges and spawns anchors.
pub use mte_slam_shaders::kernels::maintain_anchors::MaintainAnchorsParams;

use crate::kernel::{CpuDispatch, load_f32, load_u32, store_f32, store_u32};
use crate::layout::{
    ANCHOR_FLOATS, FEATURE, NO_DISTANCE, RAY_STATE_FLOATS, STATE_ANCHOR, STATE_FEATURE,
};
use core::sync::atomic::AtomicU32;

kernel! { pub static MAINTAIN_ANCHORS = mte_slam_shaders::kernels::maintain_anchors, twin }

const FREE: u32 = 255;

struct Set<'a> {
    anchors: &'a [AtomicU32],
    votes: &'a [AtomicU32],
    classes: usize,
}

impl Set<'_> {
    fn cell(&self, i: usize, k: usize) -> &AtomicU32 {
        &self.anchors[i * ANCHOR_FLOATS + k]
    }
    fn value(&self, i: usize, k: usize) -> f32 {
        load_f32(self.cell(i, k))
    }
    fn class(&self, i: usize) -> u32 {
        load_u32(self.cell(i, 16))
    }
    fn distance(&self, i: usize, feature: impl Fn(usize) -> f32) -> f32 {
        (0..FEATURE)
            .map(|k| (self.value(i, k) - feature(k)) * (self.value(i, k) - feature(k)))
            .sum()
    }
    fn clear(&self, i: usize) {
        (0..ANCHOR_FLOATS).for_each(|k| store_u32(self.cell(i, k), 0));
        store_u32(self.cell(i, 16), FREE);
        (0..self.classes).for_each(|c| store_u32(&self.votes[i * self.classes + c], 0));
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: MaintainAnchorsParams = dispatch.params();
    let Views { rays, ray_state: state, anchors, votes, anchor_counts: counts, class_support } =
        dispatch.views();
    let set = Set { anchors, votes, classes: p.classes as usize };
    // More labels than not agree, and not by a single one.
    let borne_out = |class: u32| {
        let [agree, disagree] = [0, 1].map(|k| class_support[2 * class as usize + k]);
        p.supported == 0 || agree > disagree + 1
    };
    let n = p.anchors as usize;
    let mut of_class = [0_u32; 256];
    for i in 0..n {
        of_class[set.class(i).min(255) as usize] += 1;
    }
    let count = |k: usize| store_u32(&counts[k], load_u32(&counts[k]) + 1);

    // Unimportant anchors go, but never the last of a class.
    for i in 0..n {
        let class = set.class(i);
        if class == FREE || set.value(i, 20) < p.min_age || set.value(i, 18) >= p.min_importance {
            continue;
        }
        if of_class[class as usize] > 1 {
            of_class[class as usize] -= 1;
            set.clear(i);
            count(2);
        }
    }

    // Stable duplicates become one, weighted by their matches.
    let settled = |i: usize| {
        set.class(i) != FREE && set.value(i, 20) >= p.min_age && set.value(i, 19) < p.stable
    };
    for i in 0..n {
        for j in i + 1..n {
            if !settled(i) || !settled(j) || set.class(i) != set.class(j) {
                continue;
            }
            if set.distance(i, |k| set.value(j, k)) >= p.merge_distance {
                continue;
            }
            let (a, b) = (set.value(i, 17), set.value(j, 17));
            let share = b / (a + b).max(1.0);
            for k in 0..FEATURE {
                let x = set.value(i, k);
                store_f32(set.cell(i, k), x + share * (set.value(j, k) - x));
            }
            store_f32(set.cell(i, 17), a + b);
            store_f32(set.cell(i, 18), set.value(i, 18) + set.value(j, 18));
            for c in 0..set.classes {
                let to = &set.votes[i * set.classes + c];
                store_f32(to, load_f32(to) + load_f32(&set.votes[j * set.classes + c]));
            }
            of_class[set.class(j) as usize] -= 1;
            set.clear(j);
            count(3);
        }
    }

    // A feature far from its class's anchors becomes one; classes without any come first, since
    // their distance is that to nothing.
    for _ in 0..p.spawns {
        let (mut furthest, mut chosen) = (p.spawn_distance, None);
        for ray in 0..p.rays as usize {
            let r = rays[ray];
            if r.masked() || r.class() >= p.classes || !borne_out(r.class()) {
                continue;
            }
            let at = ray * RAY_STATE_FLOATS + STATE_ANCHOR as usize * 4;
            let own = load_f32(&state[at + 2]);
            let any = load_f32(&state[at + 1]);
            let first = of_class[r.class() as usize] == 0;
            let own = if first { NO_DISTANCE } else { own };
            if own > furthest && (first || any > p.merge_distance) {
                (furthest, chosen) = (own, Some(ray));
            }
        }
        let Some(ray) = chosen else { break };
        let class = rays[ray].class();
        let mut slot = (0..n).find(|i| set.class(*i) == FREE);
        if slot.is_none() && of_class[class as usize] == 0 {
            // Full: the least important anchor that is not its class's last makes room.
            let mut least = 1e30;
            for i in 0..n {
                if of_class[set.class(i) as usize] > 1 && set.value(i, 18) < least {
                    (least, slot) = (set.value(i, 18), Some(i));
                }
            }
            if let Some(i) = slot {
                of_class[set.class(i) as usize] -= 1;
                count(2);
            }
        }
        let Some(free) = slot else { break };
        let feature = |ray: usize, k: usize| {
            load_f32(&state[ray * RAY_STATE_FLOATS + STATE_FEATURE as usize * 4 + k])
        };
        set.clear(free);
        for k in 0..FEATURE {
            store_f32(set.cell(free, k), feature(ray, k));
        }
        store_u32(set.cell(free, 16), class);
        store_f32(set.cell(free, 17), 1.0);
        store_f32(set.cell(free, 18), p.min_importance);
        store_f32(set.cell(free, 19), 2.0 * p.stable);
        store_f32(&set.votes[free * set.classes + class as usize], 1.0);
        of_class[class as usize] += 1;
        count(1);
        for other in 0..p.rays as usize {
            let d = set.distance(free, |k| feature(other, k));
            let at = other * RAY_STATE_FLOATS + STATE_ANCHOR as usize * 4;
            store_f32(&state[at + 1], load_f32(&state[at + 1]).min(d));
            if rays[other].class() == class {
                store_f32(&state[at + 2], load_f32(&state[at + 2]).min(d));
            }
        }
    }
    store_u32(&counts[0], (0..n).filter(|i| set.class(*i) != FREE).count() as u32);
}
