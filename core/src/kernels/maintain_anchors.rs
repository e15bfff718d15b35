//! Drops, merges and spawns anchors.
use super::{CpuDispatch, load_f32, load_u32, shared::Ray, store_f32, store_u32};
use crate::layout::{
    ANCHOR_FLOATS, FEATURE, NO_DISTANCE, RAY_STATE_FLOATS, STATE_ANCHOR, STATE_FEATURE,
};
use core::sync::atomic::AtomicU32;

params! {
    /// Parameters of [`MAINTAIN_ANCHORS`].
    pub struct MaintainAnchorsParams {
        /// Rays of the batch.
        rays: u32,
        /// Slots of anchors, at most 256.
        anchors: u32,
        /// Classes, at most 255.
        classes: u32,
        /// Anchors spawned at most.
        spawns: u32,
        /// A feature this far from every anchor of its class (squared) may spawn one.
        spawn_distance: f32,
        /// Anchors of a class closer than this (squared) are duplicates; nor does anything spawn
        /// this close to an anchor.
        merge_distance: f32,
        /// Duplicates merge once both move less than this an update.
        stable: f32,
        /// Less important anchors are dropped.
        min_importance: f32,
        /// Updates before an anchor may be dropped or merged.
        min_age: f32,
        /// 1: only classes that labels bear out (`class_support`) get anchors.
        supported: u32,
        /// Unused.
        spare0: u32,
        /// Unused.
        spare1: u32,
    }
}

kernel! {
    /// Drops unimportant anchors, merges stable duplicates, spawns anchors for features far from
    /// their class's; where all slots are taken, a class without any takes the place of the least
    /// important one that is not its class's last. Counts what it did (alive, spawned, dropped, merged).
    pub static MAINTAIN_ANCHORS = "maintain_anchors" {
        workgroup_size: 256,
        params: MaintainAnchorsParams,
        twin: twin,
        bindings: [
            rays: Read,
            ray_state: ReadWrite,
            anchors: ReadWrite,
            votes: ReadWrite,
            anchor_counts: ReadWrite,
            class_support: Read,
        ],
    }
}

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
    let ray_words = dispatch.read_f32(0);
    let state = dispatch.write(1);
    let set =
        Set { anchors: dispatch.write(2), votes: dispatch.write(3), classes: p.classes as usize };
    let counts = dispatch.write(4);
    let support = dispatch.read_f32(5);
    // More labels than not agree, and not by a single one.
    let borne_out = |class: u32| {
        let [agree, disagree] = [0, 1].map(|k| support[2 * class as usize + k].to_bits());
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
            let r = Ray::load(ray_words, ray);
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
        let class = Ray::load(ray_words, ray).class();
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
            if Ray::load(ray_words, other).class() == class {
                store_f32(&state[at + 2], load_f32(&state[at + 2]).min(d));
            }
        }
    }
    store_u32(&counts[0], (0..n).filter(|i| set.class(*i) != FREE).count() as u32);
}
