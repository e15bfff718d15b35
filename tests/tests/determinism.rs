//! Twenty iterations of mapping, run again, give the same bytes: no sum depends on the order in
//! which threads or workgroups run. The same of iterations that train the fusion and move anchors.
use mte_slam_core::{
    commands::Commands,
    config::{Config, Head, LossConfig},
    engine::Engine,
    kernels::shared::{FLAG_GUIDED, FLAG_MAP, FLAG_POSE},
    layout::ANCHOR_FLOATS,
    map::{Batch, Rates, SemanticSupervision},
};
use mte_slam_tests::{
    fixture::{self, CLASSES, FRAMES, Options, State},
    gpu_engine,
    rig::Rig,
};

const RAYS_PER_FRAME: u32 = 100;

/// All parameters, then poses and their state, after 20 iterations.
fn map(engine: Engine) -> Vec<Vec<u32>> {
    map_with(engine, Head::Ray, 20)
}

/// The same with a class head on every sample, whose parameters come fifth; two iterations.
fn map_with_samples(engine: Engine) -> Vec<Vec<u32>> {
    map_with(engine, Head::Sample, 2)
}

fn map_with(engine: Engine, head: Head, iterations: u32) -> Vec<Vec<u32>> {
    let mut config = Config { field: fixture::field_config(), ..Config::default() };
    config.semantics.head = head;
    (config.sampling.stratified, config.sampling.surface) = (12, 4);
    (config.mapping.rays, config.tracking.render_rays) = (FRAMES * RAYS_PER_FRAME, 1);
    config.mapping.decoder_stride = 2;
    config.keyframes.budget_mib = 1;
    let camera = fixture::camera();
    let mut d = Rig::new(engine, &config, camera, 0, fixture::shape());
    let mut r = Commands::new();
    // The map starts as free space, which trains no appearance in 20 iterations: start elsewhere.
    let state = State::new(&Options::default());
    for (tensor, name) in [
        (d.geometry, "planes_geometry"),
        (d.appearance, "planes_appearance"),
        (d.semantic, "planes_semantic"),
        (d.decoders, "decoders"),
    ] {
        r.upload(tensor.values, 0, &state.buffers[name]);
    }
    for slot in 0..FRAMES {
        d.upload_frame(&mut r, slot, &fixture::frame(slot));
        d.upload_pose(&mut r, slot, &fixture::pose(slot));
    }
    d.upload_window(&mut r, &[(2, true), (0, false), (1, false)]);
    d.submit(&r);
    let loss = LossConfig::default();
    for iteration in 0..iterations {
        let batch = Batch {
            frames: FRAMES,
            rays_per_frame: RAYS_PER_FRAME,
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
        let mut r = Commands::new();
        d.record_forward(&mut r, &batch);
        d.record_backward(&mut r, &batch);
        d.record_pose_step(&mut r, &batch, [1e-3, 1e-3], iteration == 0);
        d.record_step(&mut r, &batch, Rates { planes: 5e-3, decoders: 1e-3 });
        d.submit(&r);
    }
    assert_eq!(d.read_status(), 0, "saturated or not finite");
    let mut out = Vec::new();
    let mut tensors = vec![d.geometry, d.appearance, d.semantic, d.decoders];
    tensors.extend(d.sample_head.as_ref().map(|h| h.parameters));
    for t in tensors {
        for buffer in [t.values.floats(), t.moment1, t.moment2] {
            out.push(d.read_words(buffer, t.floats));
        }
    }
    for slot in 0..FRAMES {
        let state = d.read_pose_state(slot);
        out.push(state.iter().map(|x| x.to_bits()).collect());
    }
    let poses = d.read_poses(FRAMES);
    for (slot, pose) in poses.iter().enumerate() {
        let m = pose.expect("a finite pose").to_row_major();
        let moved =
            (0..3).any(|k| (m[4 * k + 3] - fixture::pose(slot as u32).translation[k]).abs() > 1e-4);
        assert_eq!(moved, slot != 2, "all poses move but the fixed one");
        out.push(m.iter().flat_map(|x| [x.to_bits() as u32, (x.to_bits() >> 32) as u32]).collect());
    }
    out
}

fn with_threads(threads: usize, run: fn(Engine) -> Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| run(Engine::cpu()))
}

#[test]
fn the_cpu_repeats_itself_with_any_number_of_threads() {
    let first = with_threads(1, map);
    for threads in [1, 2, 5] {
        assert!(with_threads(threads, map) == first, "{threads} threads");
    }
    // The comparison sees the training: planes and decoders have moments.
    for moments in [1, 4, 7, 10] {
        assert!(first[moments].iter().any(|word| *word != 0), "{moments}");
    }
}

#[test]
fn the_gpu_repeats_itself() {
    let Some(engine) = gpu_engine() else { return };
    let first = map(engine);
    let Some(engine) = gpu_engine() else { return };
    let second = map(engine);
    for (i, (a, b)) in first.iter().zip(&second).enumerate() {
        let differ = a.iter().zip(b).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "tensor {i}");
    }
    // One training, two engines: not the same bits, but the same steps (Adam's first ones have
    // the rate's size whatever the gradient, so rounding turns some around).
    let cpu = map(Engine::cpu());
    for tensor in [0, 3, 6, 9] {
        let float = |w: &u32| f64::from(f32::from_bits(*w));
        let pairs = || cpu[tensor].iter().map(float).zip(first[tensor].iter().map(float));
        let error = pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let size = pairs().map(|(a, _)| a * a).sum::<f64>();
        println!("tensor {tensor}: {:.1e}", (error / size).sqrt());
        assert!(error < 1e-4 * size, "tensor {tensor}: {error} of {size}");
    }
}

#[test]
fn a_head_on_every_sample_repeats_itself() {
    let first = with_threads(1, map_with_samples);
    assert!(with_threads(3, map_with_samples) == first);
    assert!([7, 13].iter().all(|moments| first[*moments].iter().any(|word| *word != 0)));
    let gpu: Vec<_> = (0..2).filter_map(|_| gpu_engine()).map(map_with_samples).collect();
    assert!(gpu.windows(2).all(|pair| pair[0] == pair[1]));
}

/// Fused features, anchors and what they train, after eight iterations: semantic planes, decoders,
/// parameters of the fusion (each with its moments), activations, anchors, votes, counts.
fn fuse(engine: Engine) -> Vec<Vec<u32>> {
    let mut config = Config { field: fixture::field_config(), ..Config::default() };
    (config.sampling.stratified, config.sampling.surface) = (12, 4);
    (config.mapping.rays, config.tracking.render_rays) = (FRAMES * RAYS_PER_FRAME, 1);
    config.keyframes.budget_mib = 1;
    let s = &mut config.suppressor;
    (s.anchors, s.min_age, s.spawns, s.decay) = (24, 2, 6, 0.9);
    (s.spawn_distance, s.merge_distance, s.stable, s.min_importance) = (0.3, 0.25, 1.0, 1.5);
    let camera = fixture::wide_camera();
    let mut d = Rig::new(engine, &config, camera, 0, fixture::shape());
    let mut r = Commands::new();
    let state = State::new(&Options::default());
    for (tensor, name) in [
        (d.geometry, "planes_geometry"),
        (d.appearance, "planes_appearance"),
        (d.semantic, "planes_semantic"),
        (d.decoders, "decoders"),
    ] {
        r.upload(tensor.values, 0, &state.buffers[name]);
    }
    for slot in 0..FRAMES {
        d.upload_frame(&mut r, slot, &fixture::frame_of(&camera, slot));
        d.upload_pose(&mut r, slot, &fixture::pose(slot));
    }
    d.upload_window(&mut r, &[(2, true), (0, true), (1, true)]);
    // One for the first features; two settled duplicates and two that nobody misses, where no
    // feature comes.
    let mut anchors = Vec::new();
    for (value, class, importance) in
        [(0.0_f32, 2, 50.0_f32), (40.0, 0, 50.0), (40.01, 0, 50.0), (50.0, 1, 2.0), (60.0, 1, 2.0)]
    {
        anchors.extend([value.to_bits(); 16]);
        anchors.push(class);
        anchors.extend([2000.0, importance, 0.0, 9.0, 0.0, 0.0, 0.0].map(f32::to_bits));
    }
    r.upload(d.suppressor.as_ref().unwrap().anchors, 0, &anchors);
    d.submit(&r);
    let loss = LossConfig::default();
    for iteration in 0..8 {
        let batch = Batch {
            frames: FRAMES,
            rays_per_frame: RAYS_PER_FRAME,
            stratified: 12,
            surface: 4,
            flags: FLAG_GUIDED | FLAG_MAP,
            loss: &loss,
            iteration,
            first: 0,
            camera: None,
            rare_share: 0.0,
            supervision: SemanticSupervision {
                compression: 0.05,
                feature: 0.1,
                ..SemanticSupervision::default()
            },
        };
        let mut r = Commands::new();
        d.record_fusion_step(&mut r, iteration % FRAMES, 1e-3);
        (0..FRAMES).for_each(|slot| d.record_fusion_forward(&mut r, slot));
        d.record_forward(&mut r, &batch);
        d.record_anchor_update(&mut r, &batch);
        d.record_anchor_maintenance(&mut r, &batch);
        d.record_backward(&mut r, &batch);
        d.record_step(&mut r, &batch, Rates { planes: 5e-3, decoders: 1e-3 });
        d.submit(&r);
    }
    assert_eq!(d.read_status(), 0, "saturated or not finite");
    let f = d.fusion.as_ref().unwrap();
    let parameters = f.parameters;
    let (tokens, stride, count) = d.tokens();
    let s = d.suppressor.as_ref().unwrap();
    let (anchors, votes, slots) = (s.anchors, s.votes, s.slots() as usize);
    let mut out = Vec::new();
    for t in [d.semantic, d.decoders, parameters] {
        for buffer in [t.values.floats(), t.moment1, t.moment2] {
            out.push(d.read_words(buffer, t.floats));
        }
    }
    for (buffer, words) in [
        (tokens, count * stride),
        (anchors.floats(), slots * ANCHOR_FLOATS),
        (votes, slots * CLASSES as usize),
    ] {
        out.push(d.read_words(buffer, words));
    }
    let counts = d.read_anchor_counts().unwrap();
    println!("{counts:?}");
    // All that can happen to an anchor happens.
    assert!(counts.alive > 10 && counts.spawned > 10, "{counts:?}");
    assert!(counts.dropped > 0 && counts.merged > 0, "{counts:?}");
    out.push(vec![counts.alive, counts.spawned, counts.dropped, counts.merged]);
    out
}

#[test]
fn fusion_and_anchors_repeat_themselves_with_any_number_of_threads() {
    let first = with_threads(1, fuse);
    for threads in [2, 5] {
        assert!(with_threads(threads, fuse) == first, "{threads} threads");
    }
    for moments in [1, 4, 7] {
        assert!(first[moments].iter().any(|word| *word != 0), "{moments}");
    }
}

#[test]
fn fusion_and_anchors_repeat_themselves_on_the_gpu() {
    let Some(engine) = gpu_engine() else { return };
    let first = fuse(engine);
    let Some(engine) = gpu_engine() else { return };
    let second = fuse(engine);
    for (i, (a, b)) in first.iter().zip(&second).enumerate() {
        let differ = a.iter().zip(b).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "tensor {i}");
    }
    // Anchors that one engine makes and the other does not would drift apart; parameters stay near.
    let cpu = fuse(Engine::cpu());
    for tensor in [0, 3, 6] {
        let float = |w: &u32| f64::from(f32::from_bits(*w));
        let pairs = || cpu[tensor].iter().map(float).zip(first[tensor].iter().map(float));
        let error = pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let size = pairs().map(|(a, _)| a * a).sum::<f64>();
        println!("tensor {tensor}: {:.1e}", (error / size).sqrt());
        assert!(error < 1e-3 * size, "tensor {tensor}: {error} of {size}");
    }
}
