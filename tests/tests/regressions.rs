//! Mistakes known from other systems of this kind, on both engines.
use mte_slam_core::{
    commands::Commands,
    config::{Config, LossConfig},
    engine::Engine,
    kernels::{
        adam::{ADAM, AdamParams},
        composite::COMPOSITE,
        composite_backward::COMPOSITE_BACKWARD,
        shared::{FLAG_DENSE, FLAG_GUIDED, FLAG_MAP, FLAG_MASK, FLAG_POSE, Grid, plane_corners},
    },
    layout::{CHANNELS, RAY_STATE_FLOATS, STATE_DEPTH},
    map::{Batch, SemanticSupervision},
    shaders::decoders::GEOMETRY,
};
use mte_slam_tests::{
    f32_words,
    fixture::{self, Options, State, run_words, words},
    gpu_engine,
    rig::Rig,
};

fn engines() -> Vec<Engine> {
    let mut engines = vec![Engine::cpu()];
    engines.extend(gpu_engine());
    engines
}

/// A depth of 0 means "not measured": no depth or distance loss, no gradient from either.
#[test]
fn rays_with_zero_depth_are_not_depth_targets() {
    let map = FLAG_GUIDED | FLAG_MAP | FLAG_POSE;
    for mut engine in engines() {
        for flags in [map, FLAG_MAP, FLAG_GUIDED | FLAG_POSE | FLAG_MASK] {
            let mut state = State::new(&Options { flags, ..Options::default() });
            (state.params.weight_color, state.params.weight_semantic) = (0.0, 0.0);
            state.forward(&mut engine);
            state.run(&mut engine, &COMPOSITE_BACKWARD);
            let (rays, out) = (state.floats("rays"), state.floats("ray_out"));
            let gradient = state.floats("distance_gradient");
            let (mut holes, mut trained) = (0, 0);
            for (i, (ray, out)) in rays.chunks(12).zip(out.chunks(12)).enumerate() {
                let n = state.params.samples as usize;
                let idle = gradient[i * n..(i + 1) * n].iter().all(|g| *g == 0.0);
                if ray[3] == 0.0 {
                    holes += 1;
                    assert_eq!((out[7], out[9], out[10]), (0.0, 0.0, 0.0), "ray {i}, {flags}");
                    assert!(idle, "ray {i}, {flags}");
                    // Tracking drops such rays altogether.
                    assert_eq!(out[11] > 0.5, flags & FLAG_MASK != 0, "ray {i}, {flags}");
                } else {
                    trained += usize::from(!idle && out[9] > 0.0);
                }
            }
            assert!(holes > 3 && trained > 30, "{holes} holes, {trained} trained");
        }
    }
}

/// A wall across the room at z = `wall_m`: one channel of a coarse plane is linear in z, and the
/// decoder passes it on, so the distance is tanh((wall - z) / truncation) exactly.
fn wall(state: &mut State, wall_m: f32) {
    let p = &state.params;
    let grid = Grid::geometry(p);
    let mut planes = vec![0.0; state.buffers["planes_geometry"].len()];
    let [nx, _, nz, _] = p.geometry_coarse;
    for iz in 0..nz {
        let z = p.box_min[2] + iz as f32 / p.geometry_inv_cell[0];
        for ix in 0..nx {
            let at = [ix as f32, 0.0, iz as f32];
            let c = plane_corners(1, at, grid.levels[0]);
            let nearest = (0..4).max_by(|a, b| c.weight[*a].total_cmp(&c.weight[*b])).unwrap();
            planes[c.cell[nearest] * CHANNELS] = (wall_m - z) / p.truncation;
        }
    }
    let mut w = vec![0.0; state.buffers["decoders"].len()];
    // relu(x) - relu(-x) through both hidden layers.
    (w[0], w[1]) = (1.0, -1.0);
    let [_, second, last] = GEOMETRY.map(|layer| layer.weights);
    (w[second], w[second + 17]) = (1.0, 1.0);
    (w[last], w[last + 1]) = (1.0, -1.0);
    state.buffers.insert("planes_geometry", f32_words(planes));
    state.buffers.insert("decoders", f32_words(w));
}

/// Without a sensor depth the second round of samples goes where the trained distance has its
/// surface, not where an untrained or another field has it.
#[test]
fn importance_samples_follow_the_trained_distance() {
    let options = Options {
        flags: FLAG_DENSE,
        stratified: 24,
        surface: 8,
        rays_per_frame: 40,
        ..Options::default()
    };
    for mut engine in engines() {
        for wall_m in [0.25, 0.5] {
            let mut state = State::new(&options);
            // All frames look along z from the middle.
            let forward = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -0.4];
            state.buffers.insert("poses", f32_words([forward; 3].into_iter().flatten()));
            state.params.first = 200;
            let near = |state: &State| {
                let (n, rays) = (state.params.samples as usize, state.params.rays as usize);
                let near = state.floats("depths");
                let near = near.iter().filter(|z| (*z - 0.4 - wall_m).abs() < 0.06).count();
                assert_eq!(state.buffers["depths"].len(), n * rays);
                near as f32 / rays as f32
            };
            // An untrained, free field: samples are spread evenly.
            let mut free = state.clone();
            wall(&mut free, 10.0);
            free.forward(&mut engine);
            wall(&mut state, wall_m);
            state.forward(&mut engine);
            let (spread, focused) = (near(&free), near(&state));
            println!("{wall_m}: {spread} samples a ray near the wall, {focused} with it");
            // All eight, and the two or three of the first round that fall there anyhow.
            assert!(focused > 9.0 && spread < 4.0, "{wall_m}: {spread} {focused}");
            // What such rays render lies on the wall, too.
            let out = state.floats("ray_out");
            let hits = out.chunks(12).filter(|r| (r[3] - 0.4 - wall_m).abs() < 0.03).count();
            let rays = state.params.rays as usize;
            assert!(hits * 10 > rays * 9, "{wall_m}: {hits} of {rays} rays render the wall");
        }
    }
}

/// A view's ray that meets the edge of a surface, which takes 60 % of its light, and a wall behind
/// shows the edge's depth; training goes by the mean of both.
#[test]
fn views_show_no_depth_between_an_edge_and_what_is_behind() {
    for mut engine in engines() {
        for (flags, view) in [(FLAG_DENSE, true), (FLAG_GUIDED | FLAG_MAP, false)] {
            let mut state = State::new(&Options { flags, ..Options::default() });
            state.forward(&mut engine);
            let (n, rays) = (state.params.samples as usize, state.params.rays as usize);
            let edge = (0.4_f32 / 0.6).ln() / state.params.sharpness;
            let distance = |i: usize| match i {
                5 => edge,
                11.. => -1.0,
                _ => 1.0,
            };
            let each =
                |value: &dyn Fn(usize) -> f32| f32_words((0..rays * n).map(|i| value(i % n)));
            state.buffers.insert("distances", each(&distance));
            state.buffers.insert("depths", each(&|i| 0.1 * i as f32));
            state.run(&mut engine, &COMPOSITE);
            let out = state.floats("ray_state");
            for (i, ray) in out.chunks(RAY_STATE_FLOATS).enumerate() {
                let at = STATE_DEPTH as usize * 4;
                let (depth, opacity) = (ray[at], ray[at + 1]);
                assert!((opacity - 1.0).abs() < 1e-3, "ray {i}: {opacity}");
                let expected = if view { 0.4 + 0.1 * 0.5 / 0.6 } else { 0.6 * 0.45 + 0.4 * 1.05 };
                assert!((depth - expected).abs() < 2e-3, "ray {i}: {depth}, not {expected}");
            }
        }
    }
}

/// Moments that fade become 0 and never denormal; parameters stay finite.
#[test]
fn adam_has_no_denormals() {
    let starts = [1e-3_f32, 1e-10, 1e-20, 1e-25, 3e-30, 1e-36];
    for mut engine in engines() {
        let n = starts.len();
        let mut state = vec![
            f32_words(vec![0.5; n]),
            Vec::new(),
            f32_words(starts),
            f32_words(starts.map(|x| x * x)),
            vec![0; 4],
        ];
        let p = AdamParams {
            count: n as u32,
            gradient_scale: 1.0,
            learning_rate: 1e-3,
            beta1: 0.5,
            beta2: 0.5,
            epsilon: 1e-15,
            correction1: 1.0,
            correction2: 1.0,
            ..AdamParams::default()
        };
        for step in 0..120 {
            // Gradients that are themselves tiny, and whose squares underflow.
            let gradient = [1e-20_f32, 1e-21, 1e-30, -2e-38, 1e-37, 1e-36];
            state[1] = f32_words(gradient);
            state = run_words(&mut engine, &ADAM, &words(&p), &state, [1, 1, 1]).unwrap();
            for (name, words) in [("first", &state[2]), ("second", &state[3])] {
                for word in words {
                    let x = f32::from_bits(*word);
                    assert!(x == 0.0 || x.is_normal(), "{name} moment {x:e} at step {step}");
                    assert!(x == 0.0 || x.abs() >= 1e-30, "{name} moment {x:e} at step {step}");
                }
            }
        }
        assert!(state[0].iter().all(|w| f32::from_bits(*w).is_finite()));
        assert_eq!(state[4][0], 0);
    }
}

/// A slot that held one frame and now holds another moves the new frame's pose exactly as a slot
/// that never held any: the pose optimiser's moments of the former frame are forgotten.
#[test]
fn a_reused_slot_forgets_the_pose_steps_of_its_former_frame() {
    const SLOT: u32 = 1;
    const RAYS: u32 = 100;
    let mut config = Config { field: fixture::field_config(), ..Config::default() };
    (config.sampling.stratified, config.sampling.surface) = (12, 4);
    (config.mapping.rays, config.tracking.render_rays) = (RAYS, 1);
    config.keyframes.budget_mib = 1;
    let loss = LossConfig::default();
    let last_step = |engine: Engine, former: Option<u32>| {
        let (camera, shape) = (fixture::camera(), fixture::shape());
        let d = &mut Rig::new(engine, &config, camera, 0, shape);
        let mut r = Commands::new();
        let state = State::new(&Options::default());
        r.upload(d.geometry.values, 0, &state.buffers["planes_geometry"]);
        r.upload(d.appearance.values, 0, &state.buffers["planes_appearance"]);
        r.upload(d.decoders.values, 0, &state.buffers["decoders"]);
        d.upload_window(&mut r, &[(SLOT, false)]);
        let step = |r: &mut Commands, iteration| {
            let batch = Batch {
                frames: 1,
                rays_per_frame: RAYS,
                stratified: 12,
                surface: 4,
                flags: FLAG_GUIDED | FLAG_MAP | FLAG_POSE,
                loss: &loss,
                iteration,
                first: 0,
                camera: None,
                rare_share: 0.0,
                supervision: SemanticSupervision::default(),
            };
            d.record_forward(r, &batch);
            d.record_backward(r, &batch);
            d.record_pose_step(r, &batch, [1e-3, 1e-3], false);
        };
        if let Some(former) = former {
            d.upload_frame(&mut r, SLOT, &fixture::frame(former));
            d.upload_pose(&mut r, SLOT, &fixture::pose(former));
            (0..5).for_each(|iteration| step(&mut r, iteration));
        }
        d.upload_frame(&mut r, SLOT, &fixture::frame(0));
        d.upload_pose(&mut r, SLOT, &fixture::pose(0));
        step(&mut r, 5);
        d.submit(&r);
        let state = d.read_pose_state(SLOT);
        let pose = d.read_poses(SLOT + 1)[SLOT as usize].unwrap();
        let moved = (pose.translation - fixture::pose(0).translation).length();
        assert!(moved > 5e-4, "the pose moved by {moved} m");
        (state, pose)
    };
    for (fresh, reused) in engines().into_iter().zip(engines()) {
        let fresh = last_step(fresh, None);
        assert_eq!(last_step(reused, Some(2)), fresh);
    }
}
