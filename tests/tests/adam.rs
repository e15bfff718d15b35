//! The Adam kernel: shader against twin, twin against a plain f64 computation.
use mte_slam_core::{
    commands::workgroups_1d,
    engine::Engine,
    kernels::adam::{ADAM, AdamParams, STATUS_NOT_FINITE, STATUS_SATURATED},
};
use mte_slam_tests::{
    Compare, Mismatch, TestRandom, Tolerance, compare_kernel, compare_outputs, f32_words,
    gpu_engine, i32_words, run_kernel,
};

const N: usize = 10_007;
const LIMIT: i32 = 1 << 28;

fn params(step: i32, fixed_point: u32) -> AdamParams {
    AdamParams {
        offset: 5,
        count: N as u32 - 9,
        fixed_point,
        gradient_limit: LIMIT,
        gradient_scale: if fixed_point == 1 { 1.0 / 65536.0 } else { 0.5 },
        learning_rate: 0.01,
        beta1: 0.9,
        beta2: 0.99,
        epsilon: 1e-15,
        correction1: 1.0 / (1.0 - 0.9f32.powi(step)),
        correction2: 1.0 / (1.0 - 0.99f32.powi(step)),
    }
}

fn tolerance() -> Tolerance {
    let float = Compare::F32 { absolute: 1e-7, relative: 1e-5 };
    let moment2 = Compare::F32 { absolute: 1e-12, relative: 1e-5 };
    Tolerance(vec![float, Compare::U32, float, moment2, Compare::U32])
}

/// Parameters, gradients (a third zero, some beyond the limit or not finite), moments, status.
fn buffers(fixed_point: u32) -> Vec<Vec<u32>> {
    let mut random = TestRandom(7);
    let mut floats = |low, high| f32_words((0..N).map(|_| random.uniform(low, high)));
    let (parameters, moment1) = (floats(-2.0, 2.0), floats(-0.1, 0.1));
    let moment2 = floats(0.0, 0.01);
    let mut random = TestRandom(8);
    let mut gradient: Vec<u32> = (0..N)
        .map(|i| match (i % 3, fixed_point) {
            (0, _) => 0,
            (_, 1) => random.bits() >> 8,
            _ => random.uniform(-3.0, 3.0).to_bits(),
        })
        .collect();
    let special = if fixed_point == 1 {
        i32_words([LIMIT, -LIMIT, LIMIT + 1, -LIMIT - 1, i32::MIN, i32::MAX])
    } else {
        f32_words([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e30, 1e-30])
    };
    gradient[1000..1000 + special.len()].copy_from_slice(&special);
    vec![parameters, gradient, moment1, moment2, vec![0; 4]]
}

#[test]
fn shader_and_twin_agree() {
    for fixed_point in [0, 1] {
        let workgroups = workgroups_1d(N, ADAM.interface.workgroup_size);
        compare_kernel(
            &ADAM,
            &params(3, fixed_point),
            &buffers(fixed_point),
            workgroups,
            &tolerance(),
        )
        .unwrap();
    }
}

#[test]
fn any_number_of_workgroups_gives_the_same() {
    let mut engines = vec![Engine::cpu()];
    engines.extend(gpu_engine());
    for mut engine in engines {
        let mut run = |workgroups| {
            run_kernel(&mut engine, &ADAM, &params(2, 0), &buffers(0), workgroups).unwrap()
        };
        let expected = run(workgroups_1d(N, ADAM.interface.workgroup_size));
        for workgroups in [[1, 1, 1], [3, 2, 1], [200, 1, 1]] {
            assert!(run(workgroups) == expected, "{workgroups:?}");
        }
    }
}

#[test]
fn a_perturbed_result_is_caught() {
    let workgroups = workgroups_1d(N, ADAM.interface.workgroup_size);
    let input = buffers(1);
    let good = run_kernel(&mut Engine::cpu(), &ADAM, &params(3, 1), &input, workgroups).unwrap();
    compare_outputs(&ADAM, &good, &good, &tolerance()).unwrap();
    for binding in 0..ADAM.interface.bindings.len() {
        let mut bad = good.clone();
        let index = bad[binding].len() / 2;
        bad[binding][index] ^= 1 << 20;
        match compare_outputs(&ADAM, &good, &bad, &tolerance()) {
            Err(Mismatch::Word { binding: name, index: at, count: 1, .. }) => {
                assert_eq!((name, at), (ADAM.interface.bindings[binding].name, index));
            }
            other => panic!("binding {binding}: {other:?}"),
        }
    }
    // The whole path: an engine that gets another gradient gives another result.
    let mut changed = input.clone();
    changed[1][100] = changed[1][100].wrapping_add(1 << 16);
    let Some(mut gpu) = gpu_engine() else { return };
    let found = run_kernel(&mut gpu, &ADAM, &params(3, 1), &changed, workgroups).unwrap();
    assert!(compare_outputs(&ADAM, &good, &found, &tolerance()).is_err());
}

/// Five steps of both engines against textbook Adam in f64.
#[test]
fn several_steps_follow_textbook_adam() {
    let mut engines = vec![Engine::cpu()];
    engines.extend(gpu_engine());
    for mut engine in engines {
        let mut state = buffers(1);
        state[1].fill(0);
        state[2].fill(0);
        state[3].fill(0);
        let as_f64 = |words: &[u32]| -> Vec<f64> {
            words.iter().map(|word| f64::from(f32::from_bits(*word))).collect()
        };
        let (mut x, mut m, mut v) = (as_f64(&state[0]), vec![0f64; N], vec![0f64; N]);
        let mut random = TestRandom(9);
        for step in 1..=5 {
            let p = params(step, 1);
            // Every parameter gets a gradient each time, as textbook Adam assumes.
            let gradient: Vec<i32> = (0..N).map(|_| (random.bits() >> 10) as i32 + 1).collect();
            for i in 5..N - 4 {
                let g = f64::from(gradient[i]) / 65536.0;
                m[i] = 0.9 * m[i] + 0.1 * g;
                v[i] = 0.99 * v[i] + 0.01 * g * g;
                let (mh, vh) =
                    (m[i] / (1.0 - 0.9f64.powi(step)), v[i] / (1.0 - 0.99f64.powi(step)));
                x[i] -= 0.01 * mh / (vh.sqrt() + 1e-15);
            }
            state[1] = i32_words(gradient);
            let workgroups = workgroups_1d(N, ADAM.interface.workgroup_size);
            state = run_kernel(&mut engine, &ADAM, &p, &state, workgroups).unwrap();
        }
        assert!(state[1][5..N - 4].iter().all(|g| *g == 0), "used gradients are cleared");
        assert!(state[1][..5].iter().chain(&state[1][N - 4..]).all(|g| *g != 0), "others stay");
        for (i, found) in as_f64(&state[0]).iter().enumerate() {
            assert!((found - x[i]).abs() < 2e-6 * x[i].abs().max(1.0), "{i}: {found} {}", x[i]);
        }
        assert_eq!(state[4][0], 0);
    }
}

#[test]
fn bad_gradients_are_skipped_and_reported() {
    for (fixed_point, bit) in [(0, STATUS_NOT_FINITE), (1, STATUS_SATURATED)] {
        let before = buffers(fixed_point);
        let workgroups = workgroups_1d(N, ADAM.interface.workgroup_size);
        let mut cpu = Engine::cpu();
        let after =
            run_kernel(&mut cpu, &ADAM, &params(1, fixed_point), &before, workgroups).unwrap();
        assert_eq!(after[4][0], bit);
        let skipped: &[usize] =
            if fixed_point == 1 { &[1002, 1003, 1004, 1005] } else { &[1000, 1001, 1002, 1004] };
        for i in 1000..1006 {
            let moved = before[0][i] != after[0][i];
            // -0.0 is a zero gradient, which changes nothing.
            let zero = before[1][i] & 0x7fff_ffff == 0 && fixed_point == 0;
            assert_eq!(moved, !skipped.contains(&i) && !zero, "{fixed_point} {i}");
            assert!(after[1][i] == 0 || zero);
        }
        // Zero gradients leave everything alone, moments too.
        for i in (0..999).step_by(3) {
            assert!((0..4).all(|buffer| before[buffer][i] == after[buffer][i]));
        }
    }
}
