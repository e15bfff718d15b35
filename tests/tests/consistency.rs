//! Every kernel's shader against its twin, from identical inputs.
use mte_slam_core::{
    engine::Engine,
    field::decoder_floats,
    kernels::{
        self,
        shared::{FLAG_ANCHORS, FLAG_DENSE, FLAG_GUIDED, FLAG_MAP, likeliest_class},
        weight_gradient::WEIGHT_GRADIENT,
    },
    layout::{
        ANCHOR_FLOATS, GEOMETRY_FLOATS, NO_ANCHOR, RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_ANCHOR,
        STATE_POSE, SURFACE_FLOATS,
    },
};
use mte_slam_tests::{
    Compare, Mismatch, Tolerance,
    anchors::maintenance,
    body::{TRAJECTORY_TOLERANCE_M, check_cases, largest_gap_m, short_run},
    case::Case,
    cases::{cases, supervised, weight_layers},
    compare_outputs,
    fixture::{CLASSES, Options, POISON, State, run_words, words},
    gpu_engine,
    recorded::Recorded,
    samples,
};
use pollster::block_on;

fn run(engine: &mut Engine, case: &Case, buffers: &[Vec<u32>]) -> Vec<Vec<u32>> {
    run_words(engine, case.kernel, &case.params, buffers, case.workgroups)
        .unwrap_or_else(|error| panic!("{}: {error}", case.name))
}

/// Both engines on every case of a kernel, then each engine from another garbage in the buffers that the kernel overwrites.
fn check(kernel: &str) {
    let cases = cases(kernel);
    assert!(!cases.is_empty(), "{kernel} has no case");
    let expected: Vec<_> =
        cases.iter().map(|case| run(&mut Engine::cpu(), case, &case.buffers)).collect();
    let mut engines = vec![Engine::cpu()];
    engines.extend(gpu_engine());
    for (which, engine) in engines.iter_mut().enumerate() {
        if let Err(difference) = block_on(check_cases(engine, &cases, &expected)) {
            panic!("engine {which}: {difference}");
        }
    }
    // Nothing is compared with itself: the kernel changes something in every case.
    for (case, after) in cases.iter().zip(&expected) {
        assert!(*after != case.buffers, "{kernel} {} does nothing", case.name);
    }
}

macro_rules! consistency {
    ($($kernel:ident)*) => {
        $(#[test]
        fn $kernel() {
            check(stringify!($kernel));
        })*
        const TESTED: &[&str] = &[$(stringify!($kernel)),*];
    };
}
consistency! {
    adam align_points attend_keys attend_queries attend_tokens composite composite_backward
    decode_rays extract_tokens gate_backward gate_tokens geometry_backward geometry_forward
    geometry_weights maintain_anchors mask_rays match_rivals matrix_product pose_gradient pose_step query_points
    recall_tokens reduce_partials sample_depths sample_features sample_logits sample_rays scatter_geometry scatter_surface settle_anchors token_layer
    token_layer_backward token_loss token_weights update_anchors weight_gradient
}

#[test]
fn every_kernel_is_tested() {
    let mut registered: Vec<&str> =
        kernels::all().iter().map(|kernel| kernel.interface.name).collect();
    registered.sort_unstable();
    assert_eq!(registered, TESTED, "a kernel without a consistency test, or the reverse");
}

/// The problem has what the cases are about: both signs, holes, masked rays, labels and none.
#[test]
fn the_problem_is_not_trivial() {
    let mut state = State::new(&Options::default());
    state.forward(&mut Engine::cpu());
    state.backward(&mut Engine::cpu());
    let share = |values: &[f32], test: &dyn Fn(f32) -> bool| {
        values.iter().filter(|x| test(**x)).count() as f32 / values.len() as f32
    };
    let negative = share(&state.floats("distances"), &|s| s < 0.0);
    assert!((0.1..0.9).contains(&negative), "{negative} of the distances are negative");
    let rays = state.floats("rays");
    let column = |k: usize| -> Vec<f32> { rays.iter().skip(k).step_by(12).copied().collect() };
    let holes = share(&column(3), &|z| z == 0.0);
    assert!((0.02..0.5).contains(&holes), "{holes} of the rays have no depth");
    let masked = share(&column(7), &|f| f.to_bits() >> 31 == 1);
    assert!((0.01..0.4).contains(&masked), "{masked} of the rays are masked");
    let unlabelled = share(&column(11), &|l| l.to_bits() & 255 == 255);
    assert!((0.05..0.7).contains(&unlabelled), "{unlabelled} of the rays have no class");
    let idle = share(&state.floats("distance_gradient"), &|g| g == 0.0);
    assert!((0.02..0.8).contains(&idle), "{idle} of the samples have no gradient");
    let light = share(&state.floats("weights"), &|w| w > 0.0 && w < 1e-3);
    assert!(light > 0.01, "{light} of the intervals are cut off");
    assert_eq!(state.buffers["status"][0], 0, "no gradient saturates");
}

/// Anchors that settle move, but for those that the head would then give another class.
#[test]
fn anchors_that_settle_keep_their_class() {
    let case = &cases("settle_anchors")[0];
    let after = run(&mut Engine::cpu(), case, &case.buffers);
    let decoders: Vec<f32> = case.buffers[2].iter().map(|w| f32::from_bits(*w)).collect();
    let (before, after) = (&case.buffers[3], &after[3]);
    let (mut moved, mut stayed) = (0, 0);
    for (b, a) in before.chunks_exact(ANCHOR_FLOATS).zip(after.chunks_exact(ANCHOR_FLOATS)) {
        assert_eq!(b[16], a[16]);
        let vector = std::array::from_fn(|k| f32::from_bits(a[k]));
        let head = likeliest_class(&decoders, &vector, CLASSES);
        match (a[16], a[..16] == b[..16]) {
            (255, same) => assert!(same),
            (class, true) if class != head => stayed += 1,
            (class, false) => {
                assert_eq!(class, head);
                moved += 1;
            }
            _ => {}
        }
    }
    assert!(moved > 10 && stayed > 2, "{moved} moved, {stayed} stayed");
}

/// One changed bit in any float, integer or counter that a kernel wrote is a mismatch.
#[test]
fn a_perturbed_output_is_caught() {
    for kernel in kernels::all() {
        let case = &cases(kernel.interface.name)[0];
        let good = run(&mut Engine::cpu(), case, &case.buffers);
        let tolerance = Tolerance(case.tolerance.clone());
        compare_outputs(kernel, &good, &good, &tolerance).unwrap();
        for (binding, before) in case.buffers.iter().enumerate() {
            if good[binding] == *before {
                continue;
            }
            // The largest value of the buffer off by a thousandth, or the class by one.
            let mut bad = good.clone();
            let words = &mut bad[binding];
            match case.tolerance[binding] {
                Compare::Columns { .. } | Compare::F32 { .. } => {
                    let size = |w: &u32| f32::from_bits(*w).abs();
                    let at = (0..words.len())
                        .max_by(|a, b| size(&words[*a]).total_cmp(&size(&words[*b])))
                        .unwrap();
                    words[at] = (f32::from_bits(words[at]) * 1.001).to_bits();
                }
                Compare::I32 { quanta } => words[7] = words[7].wrapping_add(quanta + 1),
                Compare::U32 => words[0] ^= 1,
            }
            let found = compare_outputs(kernel, &good, &bad, &tolerance);
            let name = kernel.interface.bindings[binding].name;
            match found {
                Err(Mismatch::Word { binding: b, count: 1, .. }) => assert_eq!(b, name),
                other => panic!("{} {name}: {other:?}", kernel.interface.name),
            }
        }
        // And a float lost altogether.
        let written = (0..good.len()).find(|i| {
            good[*i] != case.buffers[*i] && matches!(case.tolerance[*i], Compare::Columns { .. })
        });
        if let Some(binding) = written {
            let mut bad = good.clone();
            bad[binding][3] = POISON;
            assert!(
                compare_outputs(kernel, &good, &bad, &tolerance).is_err(),
                "{}",
                kernel.interface.name
            );
        }
    }
    // Integers among floats: as a float, another class would be a denormal difference.
    let case = &cases("sample_rays")[0];
    let good = run(&mut Engine::cpu(), case, &case.buffers);
    let mut bad = good.clone();
    bad[5][11] ^= 1;
    let tolerance = Tolerance(case.tolerance.clone());
    assert!(compare_outputs(case.kernel, &good, &bad, &tolerance).is_err());
}

/// The five layers write every weight of the per-ray decoders, each once.
#[test]
fn the_layers_cover_the_decoders() {
    let case = &cases("weight_gradient")[0];
    let row = decoder_floats(CLASSES) - GEOMETRY_FLOATS;
    let mut written = vec![0; row];
    for p in weight_layers(20, CLASSES, 30, row as u32) {
        let mut buffers = case.buffers.clone();
        buffers[2] = vec![POISON; row];
        let jobs = (p.inputs + 1) * p.outputs.div_ceil(4);
        let groups = [jobs.div_ceil(64), 1, 1];
        let after =
            run_words(&mut Engine::cpu(), &WEIGHT_GRADIENT, &words(&p), &buffers, groups).unwrap();
        after[2].iter().zip(&mut written).for_each(|(w, n)| *n += i32::from(*w != POISON));
    }
    let used = SURFACE_FLOATS + CLASSES as usize * 17;
    assert!(written[..used].iter().all(|n| *n == 1), "{written:?}");
    assert!(written[used..].iter().all(|n| *n == 0), "the rest is padding");
}

/// A whole pass does not see what an earlier one left in any buffer.
#[test]
fn a_pass_over_dirty_buffers_gives_the_same() {
    for classes in [0, CLASSES] {
        let options = Options { classes, ..Options::default() };
        let mut engine = Engine::cpu();
        let pass = |engine: &mut Engine, fill: Option<u32>| {
            let mut state = State::new(&options);
            let scratch = ["rays", "depths", "features", "distances", "weights", "ray_state"];
            let more = ["ray_out", "distance_gradient", "position_gradient"];
            for name in scratch.iter().chain(&more) {
                let words = state.buffers.get_mut(name).unwrap();
                fill.into_iter().for_each(|bits| words.fill(bits));
            }
            state.forward(engine);
            state.backward(engine);
            state
        };
        let clean = pass(&mut engine, None);
        let dirty = pass(&mut engine, Some(0xffc0_beef));
        for (name, words) in &clean.buffers {
            if *name != "ray_state" {
                assert!(dirty.buffers[name] == *words, "{name}, {classes} classes");
            }
        }
        // Poses' gradients are the last thing that a step reads of a ray's state.
        let poses = |s: &State| -> Vec<u32> {
            let pose = STATE_POSE as usize * 4..STATE_POSE as usize * 4 + 8;
            let rows = s.buffers["ray_state"].chunks_exact(RAY_STATE_FLOATS);
            rows.flat_map(|r| r[pose.clone()].to_vec()).collect()
        };
        assert!(poses(&clean) == poses(&dirty));
    }
}

/// Rays of the cases with anchors find several of them, some of another class than the head says,
/// and both losses reach rays of every window frame but no masked one.
#[test]
fn anchors_and_fused_features_are_seen() {
    let decoded = |anchors, flags, compression, feature| {
        let case = supervised("", anchors, flags, compression, feature, [0.0; 2]);
        let after = run(&mut Engine::cpu(), &case, &case.buffers);
        let rays: Vec<_> = case.buffers[0].chunks_exact(12).map(|r| (r[7], r[11])).collect();
        let at = STATE_ANCHOR as usize * 4;
        let state: Vec<[u32; 4]> = after[2]
            .chunks_exact(RAY_STATE_FLOATS)
            .map(|r| [r[at], r[at + 1], r[at + 2], r[at + 3]])
            .collect();
        let class: Vec<u32> = after[3].chunks_exact(RAY_OUT_FLOATS).map(|r| r[5]).collect();
        // Decoders and anchors.
        let given = [1, 5].map(|i| case.buffers[i].iter().map(|w| f32::from_bits(*w)).collect());
        (rays, state, class, given)
    };
    let (_, _, by_head, _) = decoded(19, FLAG_DENSE, 0.0, 0.0);
    let (_, state, by_anchor, [decoders, anchors]): (_, _, _, [Vec<f32>; 2]) =
        decoded(19, FLAG_DENSE | FLAG_ANCHORS, 0.0, 0.0);
    assert_ne!(by_head, by_anchor);
    let mut used: Vec<u32> = state.iter().map(|s| s[0]).collect();
    for (s, class) in state.iter().zip(&by_anchor) {
        let anchor = core::array::from_fn(|k| anchors[s[0] as usize * ANCHOR_FLOATS + k]);
        assert_eq!(likeliest_class(&decoders, &anchor, CLASSES), *class);
    }
    used.sort_unstable();
    used.dedup();
    assert!(used.len() > 5 && used.iter().all(|i| i % 4 != 3), "{used:?}");

    for (anchors, compression, feature) in [(19, 0.3, 0.0), (0, 0.0, 0.7)] {
        let (rays, state, ..) = decoded(anchors, FLAG_GUIDED | FLAG_MAP, compression, feature);
        let mut reached = [0; 3];
        for ((frame, _), s) in rays.iter().zip(&state) {
            let loss = f32::from_bits(s[3]);
            assert!(loss >= 0.0 && (loss == 0.0 || frame >> 31 == 0));
            reached[(frame & 255) as usize] += u32::from(loss > 0.0);
            assert!(anchors > 0 || s[0] == NO_ANCHOR);
        }
        assert!(reached.iter().all(|n| *n > 5), "{reached:?}");
    }
}

/// Doubt takes weight from a label whose anchors are further than others, from no other label; a
/// fused feature that fits the label gives some of it back.
#[test]
fn labels_far_from_their_anchors_are_doubted() {
    let labels = |doubt| {
        let case = supervised("", 19, FLAG_GUIDED | FLAG_MAP, 0.0, 0.0, doubt);
        let after = run(&mut Engine::cpu(), &case, &case.buffers);
        let rays = case.buffers[0].chunks_exact(12).enumerate();
        rays.filter_map(|(i, r)| {
            let label = (r[11] & 255) as usize;
            let state = &after[2][i * RAY_STATE_FLOATS + STATE_ANCHOR as usize * 4..];
            let [any, own] = [state[1], state[2]].map(f32::from_bits);
            let gradient = f32::from_bits(*after[4].get(i * CLASSES as usize + label)?);
            (label < CLASSES as usize).then_some((any, own, gradient))
        })
        .collect::<Vec<_>>()
    };
    let (plain, by_anchors, by_both) = (labels([0.0; 2]), labels([20.0, 0.0]), labels([20.0, 0.4]));
    let (mut doubted, mut vouched) = (0, 0);
    for ((&(any, own, full), a), b) in plain.iter().zip(&by_anchors).zip(&by_both) {
        let expected = if own < 1e30 { (20.0 * (any - own)).exp() } else { 1.0 };
        assert!((a.2 - full * expected).abs() <= 1e-5 * full.abs(), "{a:?}, {full}, {expected}");
        if expected < 1.0 {
            assert!(b.2.abs() >= a.2.abs() && b.2.abs() <= full.abs());
        }
        doubted += u32::from(expected < 0.5);
        vouched += u32::from(b.2.abs() > 1.05 * a.2.abs());
    }
    assert!(doubted > 5 && vouched > 5, "{doubted} doubted, {vouched} vouched for");
}

/// Points' classes are the head's or their nearest anchors', as asked for; free anchors have none.
#[test]
fn points_take_the_class_of_their_nearest_anchor() {
    let cases = cases("query_points");
    let classes = |i: usize| -> Vec<u32> {
        let after = run(&mut Engine::cpu(), &cases[i], &cases[i].buffers);
        after[6].chunks_exact(8).map(|v| v[1]).collect()
    };
    let (by_head, by_anchor) = (classes(1), classes(3));
    assert!(by_anchor.iter().all(|c| *c < CLASSES), "{by_anchor:?}");
    assert_ne!(by_head, by_anchor);
    let mut found = by_anchor.clone();
    found.sort_unstable();
    found.dedup();
    assert!(found.len() > 1, "{found:?}");
}

/// Products are what their definition says, not only what both sides make of it.
#[test]
fn products_follow_their_definition() {
    let mut checked = 0;
    for case in cases("matrix_product") {
        let Some(expected) = samples::expected_product(&case) else { continue };
        let after = run(&mut Engine::cpu(), &case, &case.buffers);
        for (i, (found, expected)) in after[3].iter().zip(&expected).enumerate() {
            let found = f64::from(f32::from_bits(*found));
            assert!((found - expected).abs() < 1e-4, "{} {i}: {found} {expected}", case.name);
        }
        checked += 1;
    }
    assert_eq!(checked, 5);
}

/// In views a ray's slots are its intervals that carry weight, front to back, the rest empty.
#[test]
fn slots_of_views_are_the_intervals_that_carry_weight() {
    let case = &cases("sample_features")[1];
    let after = run(&mut Engine::cpu(), case, &case.buffers);
    let floats = |words: &[u32]| words.iter().map(|w| f32::from_bits(*w)).collect::<Vec<_>>();
    let (weights, slots) = (floats(&case.buffers[2]), floats(&after[6]));
    let (mut full, mut empty) = (0, 0);
    for (ray, slots) in weights.chunks_exact(16).zip(slots.chunks_exact(5)) {
        let heavy: Vec<f32> = ray.iter().copied().filter(|w| *w > 1e-3).take(5).collect();
        assert_eq!(heavy, slots[..heavy.len()]);
        assert!(slots[heavy.len()..].iter().all(|w| *w == 0.0));
        full += usize::from(heavy.len() == 5);
        empty += usize::from(heavy.is_empty());
    }
    assert!(full > 3 && empty < 41, "{full} {empty}");
}

/// The pixel of a ray picks the token whose fused feature it is pulled to: columns across, rows
/// down, the last of each also for the rest of the image, the frame's own slot.
#[test]
fn rays_are_pulled_to_the_token_of_their_pixel() {
    let case = supervised("", 0, FLAG_GUIDED | FLAG_MAP, 0.0, 0.7, [0.0; 2]);
    let after = run(&mut Engine::cpu(), &case, &case.buffers);
    let float = |w: &u32| f64::from(f32::from_bits(*w));
    let mut tokens = Vec::new();
    for (ray, state) in
        case.buffers[0].chunks_exact(12).zip(after[2].chunks_exact(RAY_STATE_FLOATS))
    {
        let (slot, pixel) = ((ray[7] & 0x7fff_ffff) >> 8, ray[11] >> 8);
        let (u, v) = (pixel % 25, pixel / 25);
        let token = ((slot * 2 + (v / 8).min(1)) * 3 + (u / 8).min(2)) as usize;
        let target = &case.buffers[6][token * 20..token * 20 + 17];
        let feature = &state[128..144];
        let expected: f64 = feature
            .iter()
            .zip(target)
            .map(|(f, t)| 0.7 * float(&target[16]) * (float(f) - float(t)).powi(2))
            .sum();
        let found = float(&state[STATE_ANCHOR as usize * 4 + 3]);
        let masked = ray[7] >> 31 == 1;
        let expected = if masked { 0.0 } else { expected };
        assert!((found - expected).abs() < 1e-4 * expected.max(1e-3), "{found} {expected}");
        if expected > 0.0 {
            tokens.push(token);
        }
    }
    tokens.sort_unstable();
    tokens.dedup();
    // Every third of the 18 tokens has no weight.
    assert_eq!(tokens.len(), 12, "{tokens:?}");
}

/// Each case of `maintain_anchors` does what it is there for.
#[test]
fn anchors_are_dropped_merged_and_spawned() {
    let (mut total, classes) = ([0; 4], |anchors: &[u32]| {
        let mut classes: Vec<u32> = anchors.chunks_exact(ANCHOR_FLOATS).map(|a| a[16]).collect();
        classes.sort_unstable();
        classes.dedup();
        classes.retain(|c| *c != 255);
        classes
    });
    for (case, counts) in maintenance() {
        let after = run(&mut Engine::cpu(), &case, &case.buffers);
        assert_eq!(after[4], counts, "{}: alive, spawned, dropped, merged", case.name);
        let alive = after[2].chunks_exact(ANCHOR_FLOATS).filter(|a| a[16] != 255).count();
        assert_eq!(alive as u32, counts[0], "{}", case.name);
        let (before, after) = (classes(&case.buffers[2]), classes(&after[2]));
        assert!(before.iter().all(|c| after.contains(c)), "{}: a class is lost", case.name);
        assert!(case.name != "borne out" || after == [0, 2], "{after:?}");
        assert!(case.name != "evict" || after == (0..5).collect::<Vec<_>>(), "{after:?}");
        total.iter_mut().zip(counts).for_each(|(t, c)| *t += c);
    }
    assert!(total.iter().all(|n| *n > 3), "{total:?}");
}

/// A short run of the built-in sequence gives the same trajectory on both engines. (In a browser:
/// `scripts/test-web.sh`.)
#[test]
fn both_engines_walk_the_same_path() {
    let expected = block_on(short_run(Engine::cpu())).unwrap();
    if let Some(gpu) = gpu_engine() {
        let found = block_on(short_run(gpu)).unwrap();
        let gap = largest_gap_m(&expected, &found);
        println!("largest distance {gap:e} m");
        assert!(gap < TRAJECTORY_TOLERANCE_M, "{gap} m apart");
    }
    let mut off = expected.clone();
    off[3].translation.x += 2.0 * TRAJECTORY_TOLERANCE_M;
    assert!(largest_gap_m(&expected, &off) > TRAJECTORY_TOLERANCE_M);
    off[3].translation.x = f64::NAN;
    assert!(largest_gap_m(&expected, &off).is_nan(), "NaN passes no comparison");
}

/// What is written for the browser reads back, and a cut is noticed.
#[test]
fn recorded_results_round_trip() {
    let recorded = Recorded::make();
    let bytes = recorded.to_bytes();
    let back = Recorded::from_bytes(&bytes).unwrap();
    for ((a, ra), (b, rb)) in recorded.kernels.iter().zip(&back.kernels) {
        assert!(ra == rb && a.len() == b.len());
        assert!(a.iter().zip(b).all(|(a, b)| a.buffers == b.buffers && a.params == b.params));
    }
    // Rotations are orthonormalised when read: equal to the last bits.
    assert_eq!(recorded.poses.len(), back.poses.len());
    for (a, b) in recorded.poses.iter().zip(&back.poses) {
        assert!(a.translation == b.translation && a.rotation.abs_diff_eq(b.rotation, 1e-12));
    }
    assert!(Recorded::from_bytes(&bytes[..bytes.len() - 8]).is_none());
}
