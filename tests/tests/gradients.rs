//! Analytic gradients against central differences, through the passes over a map (layers,
//! offsets and dispatch sizes included) and through single kernels.
//!
//! Hard cut-offs are off (no lightest interval, no smallest gradient) and the sharpness is low.
//! ReLUs, bilinear cells and the clamped opacity leave kinks: where a step crosses one, the
//! difference is a mean of two slopes, so a small share of single parameters may be off; the
//! derivatives along whole directions, where a kink is one term of many, may not.
use glam::DVec3;
use mte_slam_core::{
    commands::Commands,
    config::{Config, Head, LossConfig},
    engine::Engine,
    kernels::{
        align_points::ALIGN_POINTS,
        sample_rays::SAMPLE_RAYS,
        shared::{FLAG_GUIDED, FLAG_MAP, FLAG_POSE},
    },
    layout::{HEAD_FLOATS, RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_POSE},
    map::{Batch, ParameterTensor, Rates, SemanticSupervision},
    shaders::decoders::{COLOR, GEOMETRY, SEMANTIC},
};
use mte_slam_tests::{
    TestRandom,
    cases::pixels,
    f32_words,
    fixture::{self, CLASSES, DEPTH_UNIT_M, FRAMES, Options, State, run_words, words},
    rig::Rig,
};
use mte_slam_types::{
    camera::Camera,
    frame::{Bounds, Frame},
    pose::Pose,
};
use std::ops::Range;

const RAYS_PER_FRAME: u32 = 40;

/// Frames without holes: the samples of a ray with depth do not depend on the field.
fn whole_frame(index: u32) -> Frame {
    let mut frame = fixture::frame(index);
    let bounds = Bounds { min: DVec3::new(-0.7, -0.45, -0.8), max: DVec3::new(0.7, 0.45, 0.8) };
    let (camera, pose) = (fixture::camera(), fixture::pose(index));
    for (i, depth) in frame.depth.iter_mut().enumerate() {
        let (u, v) = (i as u32 % camera.width, i as u32 / camera.width);
        let direction = pose.transform_vector(camera.back_project(f64::from(u), f64::from(v), 1.0));
        // A little in front of the wall: moved by a step, the hit stays in the map.
        let wall = |k: usize| {
            let limit = if direction[k] > 0.0 { bounds.max[k] } else { bounds.min[k] };
            (limit - pose.translation[k]) / direction[k]
        };
        *depth = (0.97 * wall(0).min(wall(1)).min(wall(2)) / DEPTH_UNIT_M) as u16;
    }
    frame
}

fn config() -> Config {
    let mut c = Config { field: fixture::field_config(), ..Config::default() };
    c.field.sharpness = 4.0;
    c.sampling.stratified = 14;
    c.sampling.surface = 6;
    c.sampling.min_weight = 0.0;
    c.mapping.min_gradient = 0.0;
    c.mapping.decoder_stride = 1;
    c.mapping.rays = FRAMES * RAYS_PER_FRAME;
    c.tracking.render_rays = 1;
    c.keyframes.budget_mib = 1;
    c
}

struct Problem {
    rig: Rig,
    loss: LossConfig,
    flags: u32,
    rays_per_frame: u32,
}

impl Problem {
    fn new(engine: Engine, loss: LossConfig) -> Problem {
        Problem::of(engine, loss, config())
    }

    fn of(engine: Engine, loss: LossConfig, config: Config) -> Problem {
        let camera: Camera = fixture::camera();
        let rig = Rig::new(engine, &config, camera, 0, fixture::shape());
        let flags = FLAG_GUIDED | FLAG_MAP | FLAG_POSE;
        let mut problem = Problem { rig, loss, flags, rays_per_frame: RAYS_PER_FRAME };
        let state = State::new(&Options::default());
        let d = &mut problem.rig;
        let mut r = Commands::new();
        for (tensor, name) in [
            (d.geometry, "planes_geometry"),
            (d.appearance, "planes_appearance"),
            (d.semantic, "planes_semantic"),
            (d.decoders, "decoders"),
        ] {
            r.upload(tensor.values, 0, &state.buffers[name]);
        }
        for slot in 0..FRAMES {
            d.upload_frame(&mut r, slot, &whole_frame(slot));
            d.upload_pose(&mut r, slot, &fixture::pose(slot));
        }
        d.upload_window(&mut r, &[(2, false), (0, false), (1, false)]);
        d.submit(&r);
        problem
    }

    fn batch<'a>(&self, loss: &'a LossConfig) -> Batch<'a> {
        Batch {
            frames: FRAMES,
            rays_per_frame: self.rays_per_frame,
            stratified: 14,
            surface: 6,
            flags: self.flags,
            loss,
            iteration: 5,
            first: 0,
            camera: None,
            rare_share: 0.0,
            supervision: SemanticSupervision::default(),
        }
    }

    /// The total loss of the values that are there.
    fn loss(&mut self) -> f64 {
        let loss = self.loss.clone();
        let batch = self.batch(&loss);
        let mut r = Commands::new();
        self.rig.record_forward(&mut r, &batch);
        self.rig.record_backward(&mut r, &batch);
        self.rig.submit(&r);
        let rays = FRAMES * self.rays_per_frame;
        let out = self.rig.read_ray_out(rays);
        total_loss(&out, &loss)
    }

    fn read(
        &mut self,
        buffer: impl Into<mte_slam_core::commands::BufferId>,
        floats: usize,
    ) -> Vec<f32> {
        self.rig.read(buffer, floats)
    }

    fn set(&mut self, tensor: ParameterTensor, values: &[f32]) {
        let mut r = Commands::new();
        r.upload(tensor.values, 0, values);
        self.rig.submit(&r);
    }

    /// One step with rate 0: Adam's first moments are a tenth of the gradients afterwards.
    fn gradients(&mut self) -> [Vec<f32>; 4] {
        let loss = self.loss.clone();
        let batch = self.batch(&loss);
        let mut r = Commands::new();
        self.rig.record_forward(&mut r, &batch);
        self.rig.record_backward(&mut r, &batch);
        self.rig.record_pose_step(&mut r, &batch, [0.0, 0.0], true);
        self.rig.record_step(&mut r, &batch, Rates { planes: 0.0, decoders: 0.0 });
        self.rig.submit(&r);
        assert_eq!(self.rig.read_status(), 0, "saturated or not finite");
        let d = &self.rig;
        [d.geometry, d.appearance, d.semantic, d.decoders].map(|t| {
            let moments = self.read(t.moment1, t.floats);
            moments.iter().map(|m| m * 10.0).collect()
        })
    }
}

fn total_loss(out: &[f32], loss: &LossConfig) -> f64 {
    let rays = (out.len() / RAY_OUT_FLOATS) as f64;
    let term = |r: &[f32]| {
        loss.color * f64::from(r[6])
            + loss.depth * f64::from(r[7])
            + loss.semantic * f64::from(r[8])
            + f64::from(r[9])
    };
    out.chunks_exact(RAY_OUT_FLOATS).map(term).sum::<f64>() / rays
}

fn losses() -> LossConfig {
    LossConfig {
        free_space: 1.0,
        centre: 60.0,
        tail: 10.0,
        depth: 2.0,
        color: 5.0,
        semantic: 1.0,
        balance: 0.0,
        adjustment: 0.0,
    }
}

/// Compares a part of a tensor's gradient with differences of the loss: single parameters with
/// the largest gradients, and directions.
fn check(
    problem: &mut Problem,
    tensor: ParameterTensor,
    gradient: &[f32],
    part: Range<usize>,
    name: &str,
) {
    let values = problem.read(tensor.values, tensor.floats);
    let largest = part.clone().map(|i| gradient[i].abs()).fold(0.0, f32::max);
    assert!(largest > 1e-5, "{name}: no gradient ({largest})");
    let nonzero = part.clone().filter(|i| gradient[*i] != 0.0).count();
    assert!(nonzero * 8 > part.len(), "{name}: {nonzero} of {} have one", part.len());

    let mut slope = |direction: &dyn Fn(usize) -> f32, h: f32| {
        let mut at = |h: f32| {
            let mut moved = values.clone();
            part.clone().for_each(|i| moved[i] += h * direction(i));
            problem.set(tensor, &moved);
            problem.loss()
        };
        (at(h) - at(-h)) / (2.0 * f64::from(h))
    };
    // Along the gradient itself, and along random signs of it (a sum of terms of both signs that
    // a misplaced gradient would not give).
    let norm = part.clone().map(|i| gradient[i] * gradient[i]).sum::<f32>().sqrt();
    let mut random = TestRandom(9);
    let signs: Vec<f32> =
        gradient.iter().map(|_| if random.bits().is_multiple_of(2) { -1.0 } else { 1.0 }).collect();
    for (which, along) in [("gradient", false), ("mixed", true)] {
        let direction = |i: usize| if along { signs[i] } else { 1.0 } * gradient[i] / norm;
        let expected: f64 =
            part.clone().map(|i| f64::from(direction(i)) * f64::from(gradient[i])).sum();
        let found = slope(&direction, 4e-3);
        let error = (found - expected).abs() / f64::from(norm);
        println!("{name} along {which}: {expected:.6} {found:.6}, off by {error:.1e} of the norm");
        assert!(error < 0.01, "{name} along {which}: {expected} analytic, {found} measured");
    }
    let mut order: Vec<usize> = part.clone().collect();
    order.sort_by(|a, b| gradient[*b].abs().total_cmp(&gradient[*a].abs()));
    let step = (order.len() / 3 / 12).max(1);
    let chosen: Vec<usize> = order.into_iter().step_by(step).take(12).collect();
    let mut outliers = Vec::new();
    for i in &chosen {
        let found = slope(&|k| if k == *i { 1.0 } else { 0.0 }, 4e-3);
        let expected = f64::from(gradient[*i]);
        // Differences of an f32 loss near 10 over 8e-3: noise of about 1e-5.
        if (found - expected).abs() > 0.03 * expected.abs() + 0.003 * f64::from(largest) + 2e-5 {
            outliers.push((*i, expected, found));
        }
    }
    problem.set(tensor, &values);
    assert!(outliers.len() <= 1, "{name}: {outliers:?}");
}

#[test]
fn geometry_planes_and_decoder() {
    // The gradient of the classes stops at the interval weights by design.
    let mut problem = Problem::new(Engine::cpu(), LossConfig { semantic: 0.0, ..losses() });
    let [geometry, _, _, decoders] = problem.gradients();
    let d = &problem.rig;
    let (planes, weights) = (d.geometry, d.decoders);
    let fine = d.shape.geometry[1][3] as usize * 16;
    check(&mut problem, planes, &geometry, 0..fine, "coarse geometry planes");
    check(&mut problem, planes, &geometry, fine..geometry.len(), "fine geometry planes");
    let [first, second, last] = GEOMETRY;
    for (name, part) in [
        ("geometry layer 1", first.weight_range()),
        ("geometry bias 1", first.bias_range()),
        ("geometry layer 2", second.weight_range()),
        ("geometry bias 2", second.bias_range()),
        ("geometry layer 3", last.weight_range()),
        ("geometry bias 3", last.bias_range()),
    ] {
        check(&mut problem, weights, &decoders, part, name);
    }
}

#[test]
fn appearance_and_colour_decoder() {
    let mut problem = Problem::new(Engine::cpu(), losses());
    let [_, appearance, _, decoders] = problem.gradients();
    let (planes, weights) = (problem.rig.appearance, problem.rig.decoders);
    let fine = problem.rig.shape.surface[1][3] as usize * 16;
    check(&mut problem, planes, &appearance, 0..fine, "coarse appearance planes");
    check(&mut problem, planes, &appearance, fine..appearance.len(), "fine appearance planes");
    for (name, part) in [
        ("colour layer 1", COLOR[0].weight_range()),
        ("colour bias 1", COLOR[0].bias_range()),
        ("colour layer 2", COLOR[1].weight_range()),
        ("colour bias 2", COLOR[1].bias_range()),
    ] {
        check(&mut problem, weights, &decoders, part, name);
    }
}

#[test]
fn semantic_planes_decoder_and_head() {
    let mut problem = Problem::new(Engine::cpu(), losses());
    let [_, _, semantic, decoders] = problem.gradients();
    let (planes, weights) = (problem.rig.semantic, problem.rig.decoders);
    let fine = problem.rig.shape.surface[1][3] as usize * 16;
    check(&mut problem, planes, &semantic, 0..fine, "coarse semantic planes");
    check(&mut problem, planes, &semantic, fine..semantic.len(), "fine semantic planes");
    let head = HEAD_FLOATS;
    let bias = head + CLASSES as usize * 16;
    for (name, part) in [
        ("semantic layer 1", SEMANTIC[0].weight_range()),
        ("semantic bias 1", SEMANTIC[0].bias_range()),
        ("semantic layer 2", SEMANTIC[1].weight_range()),
        ("semantic bias 2", SEMANTIC[1].bias_range()),
        ("class head", head..bias),
        ("class head's bias", bias..bias + CLASSES as usize),
    ] {
        check(&mut problem, weights, &decoders, part, name);
    }
}

/// The per-sample head: 32-256-256-256-C on every sample, logits composited.
#[test]
fn per_sample_head_and_semantic_planes() {
    let mut config = config();
    config.semantics.head = Head::Sample;
    let mut problem = Problem::of(Engine::cpu(), losses(), config);
    // A hundred times the work of a head that runs once per ray: fewer rays.
    problem.rays_per_frame = 16;
    let d = &problem.rig;
    assert!(d.fusion.is_none() && d.suppressor.is_none());
    let head = d.sample_head.as_ref().unwrap();
    let (t, layers) = (head.parameters, head.layers);
    let mut values = problem.read(t.values, t.floats);
    let mut random = TestRandom(503);
    values.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = random.uniform(-0.1, 0.1));
    problem.set(t, &values);
    let [geometry, _, semantic, decoders] = problem.gradients();
    let moments = problem.read(t.moment1, t.floats);
    let gradient: Vec<f32> = moments.iter().map(|m| m * 10.0).collect();
    for (i, layer) in layers.iter().enumerate() {
        let part = layer.weights as usize..(layer.bias() + layer.outputs) as usize;
        check(&mut problem, t, &gradient, part.clone(), &format!("layer {i}"));
        let biases = gradient[layer.bias() as usize..part.end].iter();
        assert!(biases.filter(|g| **g != 0.0).count() * 8 > layer.outputs as usize);
    }
    let planes = problem.rig.semantic;
    let fine = problem.rig.shape.surface[1][3] as usize * 16;
    check(&mut problem, planes, &semantic, 0..fine, "coarse semantic planes");
    check(&mut problem, planes, &semantic, fine..semantic.len(), "fine semantic planes");
    // The ray's decoders of classes rest; geometry gets what it gets without classes.
    assert!(decoders[SEMANTIC[0].weights..].iter().all(|g| *g == 0.0));
    let mut without = Problem::new(Engine::cpu(), LossConfig { semantic: 0.0, ..losses() });
    without.rays_per_frame = problem.rays_per_frame;
    assert!(without.gradients()[0] == geometry);
}

/// Classes move neither geometry nor appearance nor poses.
#[test]
fn semantic_gradients_stop_at_the_weights() {
    let only = LossConfig {
        free_space: 0.0,
        centre: 0.0,
        tail: 0.0,
        depth: 0.0,
        color: 0.0,
        semantic: 1.0,
        balance: 0.0,
        adjustment: 0.0,
    };
    let mut problem = Problem::new(Engine::cpu(), only);
    let [geometry, appearance, semantic, decoders] = problem.gradients();
    assert!(geometry.iter().chain(&appearance).all(|g| *g == 0.0));
    assert!(decoders[..SEMANTIC[0].weights].iter().all(|g| *g == 0.0));
    assert!(semantic.iter().any(|g| *g != 0.0));
    let state = problem.rig.read_pose_state(0);
    assert!(state[26..32].iter().all(|g| *g == 0.0), "{state:?}");
}

/// Each frame's pose: translation, and rotation about the camera's centre (left retraction).
#[test]
fn poses_of_the_window() {
    for (name, loss) in [
        ("distances", LossConfig { depth: 0.0, color: 0.0, semantic: 0.0, ..losses() }),
        (
            "colour and depth",
            LossConfig { free_space: 0.0, centre: 0.0, tail: 0.0, semantic: 0.0, ..losses() },
        ),
        ("everything", LossConfig { semantic: 0.0, ..losses() }),
    ] {
        let mut problem = Problem::new(Engine::cpu(), loss);
        problem.gradients();
        for slot in 0..FRAMES {
            let state = problem.rig.read_pose_state(slot);
            let gradient: Vec<f64> = state[26..32].iter().map(|g| f64::from(*g)).collect();
            let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            assert!(norm > 1e-3, "{name}: no gradient at frame {slot}");
            for k in 0..6 {
                // At 5e-4 a twentieth of the samples crosses a cell (errors of 8e-2); they shrink
                // with the step to 3e-3 here, where rounding starts to show.
                let h = 1.2e-5;
                let mut at = |h: f64| {
                    let mut twist = [0.0; 6];
                    twist[k] = h;
                    place(&mut problem, slot, &fixture::pose(slot).retract(&twist));
                    problem.loss()
                };
                let found = (at(h) - at(-h)) / (2.0 * h);
                place(&mut problem, slot, &fixture::pose(slot));
                let error = (found - gradient[k]).abs() / norm;
                println!("{name} {slot} {k}: {:.6} {found:.6} {error:.1e}", gradient[k]);
                assert!(error < 0.012, "{name}, frame {slot}, {k}: {} {found}", gradient[k]);
            }
        }
    }
}

fn place(problem: &mut Problem, slot: u32, pose: &Pose) {
    let mut r = Commands::new();
    problem.rig.upload_pose(&mut r, slot, pose);
    problem.rig.submit(&r);
}

/// Rays without depth and rays that leave the map, with the samples held where they are: geometry
/// planes and poses get the colour's gradient there.
#[test]
fn rays_without_depth_teach_colour() {
    let options = Options {
        rays_per_frame: 40,
        min_weight: 0.0,
        min_gradient: 0.0,
        sharpness: 4.0,
        ..Options::default()
    };
    let mut engine = Engine::cpu();
    let mut state = State::new(&options);
    state.buffers.get_mut("depth_images").unwrap().fill(0);
    state.params.weight_semantic = 0.0;
    let loss = LossConfig { depth: 1.0, color: 5.0, semantic: 0.0, ..losses() };
    state.forward(&mut engine);
    let fixed = state.clone();
    state.backward(&mut engine);
    assert_eq!(state.buffers["status"][0], 0);
    let total = |state: &mut State| {
        let mut engine = Engine::cpu();
        state.forward_from_depths(&mut engine);
        state.run(&mut engine, &mte_slam_core::kernels::composite_backward::COMPOSITE_BACKWARD);
        total_loss(&state.floats("ray_out"), &loss)
    };
    let scale = f64::from(state.params.scale_geometry);
    let gradient: Vec<f64> =
        state.buffers["gradient"].iter().map(|q| f64::from(*q as i32) / scale).collect();
    let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    assert!(norm > 1e-4, "no gradient");
    let values = state.floats("planes_geometry");
    let at = |h: f64| {
        let mut moved = fixed.clone();
        let along = values.iter().zip(&gradient).map(|(x, g)| x + (h * g / norm) as f32);
        moved.buffers.insert("planes_geometry", f32_words(along));
        total(&mut moved)
    };
    let found = (at(5e-4) - at(-5e-4)) / 1e-3;
    println!("planes {norm} {found}");
    assert!((found - norm).abs() < 0.02 * norm, "planes: {norm} {found}");

    // The pose of slot 0, which is the second frame of the window.
    let rays = options.rays_per_frame as usize;
    let mut pose_gradient = [0.0; 6];
    for ray in state.floats("ray_state").chunks_exact(RAY_STATE_FLOATS).skip(rays).take(rays) {
        for k in 0..3 {
            pose_gradient[k] += f64::from(ray[STATE_POSE as usize * 4 + k]);
            pose_gradient[3 + k] += f64::from(ray[300 + k]);
        }
    }
    let norm = pose_gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    assert!(norm > 1e-4, "no pose gradient");
    for k in 0..6 {
        let at = |h: f64| {
            let mut twist = [0.0; 6];
            twist[k] = h;
            let mut moved = fixed.clone();
            let pose = mte_slam_core::map::pose_words(&fixture::pose(0).retract(&twist));
            moved.buffers.get_mut("poses").unwrap()[..12].copy_from_slice(&f32_words(pose));
            moved.run(&mut Engine::cpu(), &SAMPLE_RAYS);
            total(&mut moved)
        };
        let found = (at(1.2e-5) - at(-1.2e-5)) / 2.4e-5;
        println!("pose {k} {} {found}", pose_gradient[k]);
        assert!(
            (found - pose_gradient[k]).abs() < 0.03 * norm,
            "{k}: {} {found}",
            pose_gradient[k]
        );
    }
}

/// J^T W r of align_points is the gradient of the robust (Geman-McClure) cost, and its matrix is
/// the square of the Jacobian: at single pixels, each residual on its own.
#[test]
fn alignment_to_the_field() {
    let mut state = State::new(&Options::default());
    let mut engine = Engine::cpu();
    state.params.rays = 1;
    state.buffers.insert("partials", vec![0; 32]);
    let pose = fixture::pose(0);
    let (robust_s, robust_c) = (state.params.robust_distance, state.params.robust_intensity);
    let inverse = [state.params.inv_sigma_distance, state.params.inv_sigma_intensity];
    let mut row = |pixel: &[f32; 4], pose: &Pose, kind: usize| -> Vec<f64> {
        let mut p = state.params;
        [p.inv_sigma_distance, p.inv_sigma_intensity] =
            if kind == 0 { [inverse[0], 0.0] } else { [0.0, inverse[1]] };
        let mut poses = f32_words(mte_slam_core::map::pose_words(pose));
        poses.resize(36, 0);
        state.buffers.insert("poses", poses);
        state.buffers.insert("pixels", f32_words(*pixel));
        let buffers = state.inputs(&ALIGN_POINTS);
        let out = run_words(&mut engine, &ALIGN_POINTS, &words(&p), &buffers, [1, 1, 1]).unwrap();
        out[5].iter().map(|w| f64::from(f32::from_bits(*w))).collect()
    };
    let (mut used, mut outliers, mut checked) = (0, 0, 0);
    for pixel in &pixels(60) {
        for kind in 0..2 {
            let (sigma, robust) = if kind == 0 {
                (f64::from(inverse[0]), f64::from(robust_s))
            } else {
                (f64::from(inverse[1]), f64::from(robust_c))
            };
            let here = row(pixel, &pose, kind);
            if here[29] == 0.0 {
                continue;
            }
            used += 1;
            // g = w j r and H = w j j^T, so H = g g^T / (w r^2).
            let wrr = here[27] + here[28];
            let g = &here[21..27];
            let mut k = 0;
            for a in 0..6 {
                for b in a..6 {
                    let h = g[a] * g[b] / wrr.max(1e-12);
                    let size = (g.iter().map(|x| x * x).sum::<f64>() / wrr.max(1e-12)).max(1e-6);
                    assert!((here[k] - h).abs() < 1e-3 * size, "{a} {b}: {} {h}", here[k]);
                    k += 1;
                }
            }
            let cost = |row: &[f64]| {
                let r = row[30 + kind];
                let e = r / robust;
                0.5 * sigma * sigma * r * r / (1.0 + e * e)
            };
            let norm = g.iter().map(|x| x * x).sum::<f64>().sqrt();
            for k in 0..6 {
                let h = 1e-4;
                let mut at = |h: f64| {
                    let mut twist = [0.0; 6];
                    twist[k] = h;
                    row(pixel, &pose.retract(&twist), kind)
                };
                let (above, below) = (at(h), at(-h));
                if above[29] == 0.0 || below[29] == 0.0 {
                    continue;
                }
                let found = (cost(&above) - cost(&below)) / (2.0 * h);
                checked += 1;
                if (found - g[k]).abs() > 0.03 * norm + 1e-2 {
                    outliers += 1;
                }
            }
        }
    }
    println!("{used} residuals, {outliers} of {checked} derivatives off");
    assert!(used > 40, "{used}");
    // Single pixels cross a cell's edge or a ReLU's kink within the step now and then.
    assert!(outliers * 12 < checked, "{outliers} of {checked}");
}
