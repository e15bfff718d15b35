//! Cases of the kernels on anchors.
use crate::{
    Compare, TestRandom,
    case::{Case, SUMS},
    f32_words,
    fixture::{CLASSES, words},
    tokens::random,
};
use mte_slam_core::{
    commands::workgroups_1d,
    field::decoder_floats,
    kernel::Kernel,
    kernels::{
        maintain_anchors::{MAINTAIN_ANCHORS, MaintainAnchorsParams},
        match_rivals::{MATCH_RIVALS, MatchRivalsParams},
        settle_anchors::{SETTLE_ANCHORS, SettleAnchorsParams},
        shared::{RAY_MASKED, RAY_WORDS, Ray},
        update_anchors::{UPDATE_ANCHORS, UpdateAnchorsParams},
    },
    layout::{
        ANCHOR_FLOATS, FEATURE, HEAD_FLOATS, NO_ANCHOR, NO_DISTANCE, RAY_OUT_FLOATS,
        RAY_STATE_FLOATS, STATE_ANCHOR, STATE_FEATURE,
    },
};
use std::collections::BTreeSet;

/// Slots of anchors.
const ANCHORS: u32 = 21;

/// An anchor before it is words.
#[derive(Clone, Copy)]
struct Anchor {
    class: u32,
    matches: f32,
    importance: f32,
    variation: f32,
    age: f32,
}

const SETTLED: Anchor =
    Anchor { class: 0, matches: 30.0, importance: 9.0, variation: 0.01, age: 50.0 };

fn anchor_words(vector: impl Iterator<Item = f32>, a: Anchor) -> Vec<u32> {
    let mut words = f32_words(vector);
    words.push(a.class);
    words.extend(f32_words([a.matches, a.importance, a.variation, a.age, 0.0, 0.0, 0.0]));
    assert_eq!(words.len(), ANCHOR_FLOATS);
    words
}

/// Rays with labels (some unlabelled) and masks, and features spread out by `size`.
fn labelled_rays(count: usize, classes: u32, size: f32) -> (Vec<Ray>, Vec<[f32; FEATURE]>) {
    let mut random = TestRandom(371);
    (0..count as u32)
        .map(|i| {
            let class = if random.bits().is_multiple_of(9) { 255 } else { random.bits() % classes };
            let mask = if random.bits().is_multiple_of(7) { RAY_MASKED } else { 0 };
            let ray = Ray {
                depth: random.uniform(0.5, 2.0),
                frame: 1 | 2 << 8 | mask,
                label: class | i << 8,
                ..Ray::default()
            };
            (ray, core::array::from_fn(|_| random.uniform(-size, size)))
        })
        .unzip()
}

/// What `decode_rays` leaves of rays and features: the nearest anchor, and the distances.
fn matched(rays: &[Ray], features: &[[f32; FEATURE]], anchors: &[u32]) -> Vec<u32> {
    let mut state = random(rays.len() * RAY_STATE_FLOATS, 372, 1.0);
    for ((ray, feature), row) in
        rays.iter().zip(features).zip(state.chunks_exact_mut(RAY_STATE_FLOATS))
    {
        let (mut best, mut any, mut own) = (NO_ANCHOR, NO_DISTANCE, NO_DISTANCE);
        for (i, a) in anchors.chunks_exact(ANCHOR_FLOATS).enumerate() {
            if a[16] == 255 {
                continue;
            }
            let d: f32 = (0..FEATURE).map(|k| (feature[k] - f32::from_bits(a[k])).powi(2)).sum();
            if d < any {
                (best, any) = (i as u32, d);
            }
            if a[16] == ray.class() {
                own = own.min(d);
            }
        }
        let at = STATE_ANCHOR as usize * 4;
        row[at..at + 4].copy_from_slice(&[best, any.to_bits(), own.to_bits(), 0]);
        let at = STATE_FEATURE as usize * 4;
        row[at..at + FEATURE].copy_from_slice(&f32_words(*feature));
    }
    state
}

fn ray_words(rays: &[Ray]) -> Vec<u32> {
    rays.iter().flat_map(Ray::words).collect()
}

/// Vote counts of each anchor and class.
fn votes(anchors: u32) -> Vec<u32> {
    let mut random = TestRandom(373);
    f32_words((0..anchors * CLASSES).map(|_| random.uniform(0.0, 2.0)))
}

/// Columns of `ray_state` that hold indices of anchors.
const INDICES: [usize; 2] = [STATE_ANCHOR as usize * 4, STATE_ANCHOR as usize * 4 + 1];

fn anchor_tolerance(kernel: &Kernel) -> Vec<Compare> {
    let one = |name| match name {
        "anchors" => Compare::Columns { row: ANCHOR_FLOATS, bits: &[16], relative: SUMS },
        "rays" => Compare::Columns { row: RAY_WORDS, bits: &[7, 11], relative: SUMS },
        "votes" => Compare::Columns { row: CLASSES as usize, bits: &[], relative: SUMS },
        "ray_state" => Compare::Columns {
            row: RAY_STATE_FLOATS,
            bits: if kernel.interface.name == MATCH_RIVALS.interface.name {
                &INDICES
            } else {
                &INDICES[..1]
            },
            relative: SUMS,
        },
        _ => Compare::U32,
    };
    kernel.interface.bindings.iter().map(|binding| one(binding.name)).collect()
}

/// Anchors among the features, every fifth slot free, of the first `classes` classes.
fn spread_anchors(classes: u32) -> Vec<u32> {
    let mut random = TestRandom(381);
    (0..ANCHORS)
        .flat_map(|i| {
            let vector: Vec<f32> = (0..FEATURE).map(|_| random.uniform(-0.6, 0.6)).collect();
            let class = if i % 5 == 4 { 255 } else { i % classes };
            let matches = random.uniform(0.0, 50.0);
            anchor_words(vector.into_iter(), Anchor { class, matches, ..SETTLED })
        })
        .collect()
}

/// Labels that agree with the head's class and do not, by class: they bear out 0 and 2.
fn support() -> Vec<u32> {
    vec![9, 0, 0, 0, 3, 1, 2, 1, 5, 9]
}

/// What `decode_rays` leaves of rays' classes: the labels', unlabelled rays a class by their number.
fn ray_out(rays: &[Ray]) -> Vec<u32> {
    let mut out = random(rays.len() * RAY_OUT_FLOATS, 374, 1.0);
    for (i, (ray, row)) in rays.iter().zip(out.chunks_exact_mut(RAY_OUT_FLOATS)).enumerate() {
        row[5] = if ray.class() == 255 { i as u32 % CLASSES } else { ray.class() };
    }
    out
}

/// Cases of `match_rivals`: all classes have anchors, some do not, and one alone has.
fn match_rivals() -> Vec<Case> {
    let one = |name, classes| {
        let (mut rays, features) = labelled_rays(300, CLASSES, 1.0);
        let anchors = spread_anchors(classes);
        let state = matched(&rays, &features, &anchors);
        let out = ray_out(&rays);
        // Half of the labels are not the head's.
        rays.iter_mut().step_by(2).for_each(|ray| ray.label ^= 1);
        let p = MatchRivalsParams {
            rays: rays.len() as u32,
            anchors: ANCHORS,
            classes: CLASSES,
            ..MatchRivalsParams::default()
        };
        Case {
            name,
            kernel: &MATCH_RIVALS,
            params: words(&p),
            buffers: vec![out, anchors, ray_words(&rays), state, support()],
            workgroups: workgroups_1d(rays.len(), 64),
            tolerance: anchor_tolerance(&MATCH_RIVALS),
            overwritten: Vec::new(),
        }
    };
    vec![one("all classes", CLASSES), one("two classes", 2), one("one class", 1)]
}

/// A case of `settle_anchors` after `match_rivals`. The head prefers class c along the c-th channel,
/// and no class without anchors; every third anchor may be of another class than the head's, and every
/// fourth ray has no rival.
fn settle(name: &'static str, before: &Case, rays: u32, slope: f32) -> Case {
    let [out, anchors, labels, state, _] = &before.buffers[..] else { unreachable!() };
    let (mut anchors, mut state) = (anchors.clone(), state.clone());
    let known: BTreeSet<u32> =
        anchors.chunks_exact(ANCHOR_FLOATS).map(|a| a[16]).filter(|c| *c != 255).collect();
    for (i, a) in anchors.chunks_exact_mut(ANCHOR_FLOATS).enumerate() {
        if a[16] != 255 && i % 3 > 0 {
            let along = |c: &&u32| f32::from_bits(a[**c as usize]);
            a[16] = *known.iter().max_by(|x, y| along(x).total_cmp(&along(y))).unwrap();
        }
    }
    let row = |i: usize| i * RAY_STATE_FLOATS..(i + 1) * RAY_STATE_FLOATS;
    for (i, out) in out.chunks_exact(RAY_OUT_FLOATS).enumerate() {
        let state = &mut state[row(i)];
        let mut nearest = [(NO_ANCHOR, NO_DISTANCE); 2];
        for (index, a) in anchors.chunks_exact(ANCHOR_FLOATS).enumerate() {
            let x = &state[STATE_FEATURE as usize * 4..];
            let d =
                (0..FEATURE).map(|k| (f32::from_bits(x[k]) - f32::from_bits(a[k])).powi(2)).sum();
            let n = &mut nearest[usize::from(a[16] != out[5])];
            if a[16] != 255 && d < n.1 {
                *n = (index as u32, d);
            }
        }
        let [own, mut rival] = nearest;
        if i % 4 == 3 {
            rival = (NO_ANCHOR, NO_DISTANCE);
        }
        state[STATE_ANCHOR as usize * 4..][..4].copy_from_slice(&[
            own.0,
            rival.0,
            own.1.to_bits(),
            rival.1.to_bits(),
        ]);
    }
    let mut decoders = vec![0.0; decoder_floats(CLASSES)];
    for c in 0..CLASSES as usize {
        decoders[HEAD_FLOATS + c * 16 + c] = 1.0;
        if !known.contains(&(c as u32)) {
            decoders[HEAD_FLOATS + CLASSES as usize * 16 + c] = -10.0;
        }
    }
    let p = SettleAnchorsParams {
        rays,
        anchors: ANCHORS,
        classes: CLASSES,
        rate: 0.3,
        slope,
        ..SettleAnchorsParams::default()
    };
    Case {
        name,
        kernel: &SETTLE_ANCHORS,
        params: words(&p),
        buffers: vec![labels.clone(), state, f32_words(decoders), anchors],
        workgroups: [ANCHORS, 1, 1],
        tolerance: anchor_tolerance(&SETTLE_ANCHORS),
        overwritten: Vec::new(),
    }
}

fn settle_anchors() -> Vec<Case> {
    let [all, two, _] = &match_rivals()[..] else { unreachable!() };
    vec![
        settle("all classes", all, 300, 10.0),
        settle("two classes", two, 300, 3.0),
        settle("sharp", all, 300, 400.0),
        settle("classes alone", all, 0, 10.0),
    ]
}

fn update_anchors() -> Vec<Case> {
    let one = |name, rays: usize, rule, beta, memory| {
        let (rays, features) = labelled_rays(rays, CLASSES, 1.0);
        let anchors = spread_anchors(CLASSES);
        let p = UpdateAnchorsParams {
            rays: rays.len() as u32,
            anchors: ANCHORS,
            classes: CLASSES,
            rule,
            beta,
            memory,
            decay: 0.9,
            variation_decay: 0.8,
        };
        let state = matched(&rays, &features, &anchors);
        Case {
            name,
            kernel: &UPDATE_ANCHORS,
            params: words(&p),
            buffers: vec![ray_words(&rays), state, anchors, votes(ANCHORS)],
            workgroups: [ANCHORS, 1, 1],
            tolerance: anchor_tolerance(&UPDATE_ANCHORS),
            overwritten: Vec::new(),
        }
    };
    vec![
        one("running mean", 300, 1, 0.05, 1000.0),
        one("moving average", 300, 0, 0.05, 1000.0),
        one("full memory", 300, 1, 0.05, 20.0),
        one("few rays", 20, 0, 1.0, 1000.0),
    ]
}

/// What a maintenance case is about: which slot holds what, and how many anchors may spawn.
struct Maintenance {
    name: &'static str,
    /// Vector (a multiple of ones) and the rest, by slot; other slots are free.
    anchors: Vec<(f32, Anchor)>,
    slots: u32,
    spawns: u32,
    spawn_distance: f32,
    /// Classes of the rays' labels.
    labels: u32,
    /// Only classes that labels bear out get anchors.
    supported: bool,
}

/// Cases of `maintain_anchors`, with what they must do: (alive, spawned, dropped, merged).
pub fn maintenance() -> Vec<(Case, [u32; 4])> {
    let (class, weak) = (|class| Anchor { class, ..SETTLED }, 0.5);
    let unimportant = |c| Anchor { importance: weak, ..class(c) };
    let young = |c| Anchor { age: 3.0, ..class(c) };
    let moving = |c| Anchor { variation: 0.5, ..class(c) };
    // Vectors differ by 0.01 * 4 in length within a group, by 4 and more between groups.
    let plain = |name, anchors| Maintenance {
        name,
        anchors,
        slots: ANCHORS,
        spawns: 0,
        spawn_distance: 1e9,
        labels: CLASSES,
        supported: false,
    };
    let far = vec![(9.0, class(0)), (-9.0, class(1)), (19.0, class(2))];
    let all_classes: Vec<_> = (0..CLASSES).map(|c| (0.1 * c as f32, class(c))).collect();
    vec![
        // Three of class 0 go until one is left; the only one of class 1 and a young one stay.
        (
            plain(
                "drop",
                vec![
                    (1.0, unimportant(0)),
                    (2.0, unimportant(0)),
                    (3.0, unimportant(0)),
                    (4.0, unimportant(1)),
                    (5.0, Anchor { age: 3.0, ..unimportant(2) }),
                    (6.0, class(2)),
                    (7.0, unimportant(2)),
                ],
            ),
            [4, 0, 3, 0],
        ),
        // Three duplicates of class 0 and two of class 3 become one each. Not so: another class,
        // a moving one, a young one.
        (
            plain(
                "merge",
                vec![
                    (1.0, class(0)),
                    (1.01, class(1)),
                    (1.02, Anchor { matches: 90.0, ..class(0) }),
                    (5.0, class(3)),
                    (0.99, class(0)),
                    (1.01, moving(0)),
                    (1.01, young(0)),
                    (5.01, Anchor { matches: 0.0, importance: 3.0, ..class(3) }),
                ],
            ),
            [5, 0, 0, 3],
        ),
        // The first moves half way to the third: the second, which is close only now, was passed by, the
        // fourth was not.
        (
            plain(
                "merge in order",
                vec![(0.0, class(0)), (0.16, class(0)), (0.11, class(0)), (0.17, class(0))],
            ),
            [2, 0, 0, 2],
        ),
        // As many as there may be, four in a place.
        (
            Maintenance {
                slots: 256,
                ..plain(
                    "merge many",
                    (0..256).map(|i| (0.5 * (i % 64) as f32, class(i % 64 % CLASSES))).collect(),
                )
            },
            [64, 0, 0, 192],
        ),
        // Every class's first anchor.
        (
            Maintenance { spawns: 7, spawn_distance: 1e6, ..plain("first anchors", vec![]) },
            [CLASSES, CLASSES, 0, 0],
        ),
        // The first anchors of those that labels bear out.
        (
            Maintenance {
                spawns: 7,
                spawn_distance: 1e6,
                supported: true,
                ..plain("borne out", vec![])
            },
            [2, 2, 0, 0],
        ),
        // Features far from their class's anchors, as many as may.
        (Maintenance { spawns: 6, spawn_distance: 1.0, ..plain("spawn", far) }, [9, 6, 0, 0]),
        // Only so many slots are free.
        (
            Maintenance {
                spawns: 8,
                spawn_distance: 1.0,
                slots: CLASSES + 2,
                ..plain("few free slots", all_classes.clone())
            },
            [CLASSES + 2, 2, 0, 0],
        ),
        (
            Maintenance {
                spawns: 8,
                spawn_distance: 1.0,
                slots: CLASSES,
                ..plain("full", all_classes.clone())
            },
            [CLASSES, 0, 0, 0],
        ),
        // Classes without any anchor take the places of the least important, never of a class's last.
        (
            Maintenance {
                spawns: 8,
                spawn_distance: 1.0,
                slots: CLASSES,
                ..plain(
                    "evict",
                    vec![
                        (1.0, class(0)),
                        (2.0, Anchor { importance: 3.0, ..class(0) }),
                        (3.0, class(1)),
                        (4.0, Anchor { importance: 2.0, ..class(2) }),
                        (5.0, Anchor { importance: 4.0, ..class(1) }),
                    ],
                )
            },
            [CLASSES, 2, 2, 0],
        ),
        // One drops, two merge, and their slots are used again.
        (
            Maintenance {
                spawns: 3,
                spawn_distance: 1.0,
                slots: 6,
                ..plain(
                    "everything",
                    vec![
                        (0.0, class(0)),
                        (3.0, unimportant(0)),
                        (0.01, class(0)),
                        (5.0, class(1)),
                        (5.01, class(1)),
                        (2.0, class(2)),
                    ],
                )
            },
            [6, 3, 1, 2],
        ),
        // Nothing is far from its class.
        (
            Maintenance { spawns: 8, spawn_distance: 1e6, ..plain("close", all_classes) },
            [CLASSES, 0, 0, 0],
        ),
    ]
    .into_iter()
    .map(|(m, counts)| (maintenance_case(&m), counts))
    .collect()
}

fn maintenance_case(m: &Maintenance) -> Case {
    let (rays, features) = labelled_rays(150, m.labels, 1.0);
    let mut random = TestRandom(391);
    let mut anchors = Vec::new();
    for slot in 0..m.slots as usize {
        let (at, a) = m.anchors.get(slot).copied().unwrap_or((
            0.0,
            Anchor { class: 255, matches: 0.0, importance: 0.0, variation: 0.0, age: 0.0 },
        ));
        let vector: Vec<f32> = (0..FEATURE).map(|_| at + random.uniform(-0.001, 0.001)).collect();
        anchors.extend(anchor_words(vector.into_iter(), a));
    }
    let p = MaintainAnchorsParams {
        rays: rays.len() as u32,
        anchors: m.slots,
        classes: CLASSES,
        spawns: m.spawns,
        spawn_distance: m.spawn_distance,
        merge_distance: 0.25,
        stable: 0.1,
        min_importance: 1.0,
        min_age: 40.0,
        supported: u32::from(m.supported),
        ..MaintainAnchorsParams::default()
    };
    let state = matched(&rays, &features, &anchors);
    Case {
        name: m.name,
        kernel: &MAINTAIN_ANCHORS,
        params: words(&p),
        buffers: vec![ray_words(&rays), state, anchors, votes(m.slots), vec![0; 4], support()],
        workgroups: [1, 1, 1],
        tolerance: anchor_tolerance(&MAINTAIN_ANCHORS),
        overwritten: Vec::new(),
    }
}

/// All cases of a kernel on anchors.
pub(crate) fn cases(kernel: &str) -> Option<Vec<Case>> {
    Some(match kernel {
        "maintain_anchors" => maintenance().into_iter().map(|(case, _)| case).collect(),
        "match_rivals" => match_rivals(),
        "settle_anchors" => settle_anchors(),
        "update_anchors" => update_anchors(),
        _ => return None,
    })
}
