//! Every kernel's shader against its twin, from identical inputs.
use mte_slam_core::{
    engine::{Engine, GpuOptions},
    field::decoder_floats,
    kernels::{self, weight_gradient::WEIGHT_GRADIENT},
    layout::GEOMETRY_FLOATS,
    shader,
};
use mte_slam_tests::{
    Compare, Mismatch, Tolerance,
    cases::{Case, cases, weight_layers},
    compare_outputs,
    fixture::{CLASSES, Options, POISON, State, run_words, words},
    gpu_engine_with,
};

fn run(engine: &mut Engine, case: &Case, buffers: &[Vec<u32>]) -> Vec<Vec<u32>> {
    run_words(engine, case.kernel, &case.params, buffers, case.workgroups)
        .unwrap_or_else(|error| panic!("{}: {error}", case.name))
}

/// Both engines on every case of a kernel, the GPU's with loops unrolled and not; then each
/// engine from another garbage in the buffers that the kernel overwrites.
fn check(kernel: &str) {
    let cases = cases(kernel);
    assert!(!cases.is_empty(), "{kernel} has no case");
    let expected: Vec<_> =
        cases.iter().map(|case| run(&mut Engine::cpu(), case, &case.buffers)).collect();
    let mut engines = vec![Engine::cpu()];
    let source = |unroll| shader::compose(cases[0].kernel, &[("UNROLL", unroll)]).unwrap();
    let variants: &[u32] = if source(0) == source(1) { &[1] } else { &[1, 0] };
    for unroll in variants {
        let overrides = vec![("UNROLL", *unroll)];
        engines.extend(gpu_engine_with(GpuOptions { overrides, ..Default::default() }));
    }
    for (which, engine) in engines.iter_mut().enumerate() {
        for (case, expected) in cases.iter().zip(&expected) {
            let found = run(engine, case, &case.buffers);
            let context = |error: Mismatch| panic!("{}, engine {which}: {error:?}", case.name);
            compare_outputs(case.kernel, expected, &found, &Tolerance(case.tolerance.clone()))
                .unwrap_or_else(context);
            if case.overwritten.is_empty() {
                continue;
            }
            let mut dirty = case.buffers.clone();
            for (binding, words) in case.kernel.bindings.iter().zip(&mut dirty) {
                if case.overwritten.contains(&binding.name) {
                    words.iter_mut().enumerate().for_each(|(i, w)| *w = 0x4b1d_0000 ^ i as u32);
                }
            }
            let again = run(engine, case, &dirty);
            for (i, binding) in case.kernel.bindings.iter().enumerate() {
                let name = (case.kernel.name, case.name, binding.name);
                assert!(again[i] == found[i], "{name:?} depends on what was there");
                let partial = !case.overwritten.contains(&binding.name);
                assert!(partial || !found[i].contains(&POISON), "{name:?} is not fully written");
            }
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
    adam align_points composite composite_backward decode_rays geometry_backward geometry_forward
    geometry_weights mask_rays pose_gradient pose_step query_points reduce_partials sample_depths
    sample_rays scatter_geometry scatter_surface weight_gradient
}

#[test]
fn every_kernel_is_tested() {
    let mut registered: Vec<&str> = kernels::all().iter().map(|kernel| kernel.name).collect();
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
    let unlabelled = share(&column(11), &|l| l.to_bits() == 255);
    assert!((0.05..0.7).contains(&unlabelled), "{unlabelled} of the rays have no class");
    let idle = share(&state.floats("distance_gradient"), &|g| g == 0.0);
    assert!((0.02..0.8).contains(&idle), "{idle} of the samples have no gradient");
    let light = share(&state.floats("weights"), &|w| w > 0.0 && w < 1e-3);
    assert!(light > 0.01, "{light} of the intervals are cut off");
    assert_eq!(state.buffers["status"][0], 0, "no gradient saturates");
}

/// One changed bit in any float, integer or counter that a kernel wrote is a mismatch.
#[test]
fn a_perturbed_output_is_caught() {
    for kernel in kernels::all() {
        let case = &cases(kernel.name)[0];
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
            let name = kernel.bindings[binding].name;
            match found {
                Err(Mismatch::Word { binding: b, count: 1, .. }) => assert_eq!(b, name),
                other => panic!("{} {name}: {other:?}", kernel.name),
            }
        }
        // And a float lost altogether.
        let written = (0..good.len()).find(|i| {
            good[*i] != case.buffers[*i] && matches!(case.tolerance[*i], Compare::Columns { .. })
        });
        if let Some(binding) = written {
            let mut bad = good.clone();
            bad[binding][3] = POISON;
            assert!(compare_outputs(kernel, &good, &bad, &tolerance).is_err(), "{}", kernel.name);
        }
    }
    // Integers among floats: as a float, another class would be a denormal difference.
    let case = &cases("sample_rays")[0];
    let good = run(&mut Engine::cpu(), case, &case.buffers);
    let mut bad = good.clone();
    bad[4][11] ^= 1;
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
    let used = 2772 + CLASSES as usize * 17;
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
            s.buffers["ray_state"].chunks_exact(304).flat_map(|r| r[296..304].to_vec()).collect()
        };
        assert!(poses(&clean) == poses(&dirty));
    }
}
