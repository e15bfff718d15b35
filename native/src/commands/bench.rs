//! `mte-slam bench`: what one optimisation iteration costs, and which kernel how much of it.
//!
//! The scene is the inside of a box as large as the bound, so that every ray meets a surface in
//! the map; its content does not change the work. Whole iterations are timed as a run submits
//! them, several in a row with one wait at the end; kernels are timed one by one with a wait
//! after each, so their sum holds the waits and is above the whole.
//!
//! The semantic path (planes to class) is what the kernels that have to do with classes take more
//! than in a map without classes; kernels are picked out of an iteration and submitted together.
use crate::{
    args::{BenchArgs, EngineArgs},
    engine,
    screen::Screen,
};
use anyhow::{Context, Result};
use glam::DVec3;
use mte_slam_core::{
    commands::{Command, Commands},
    config::{Config, Head},
    engine::Engine,
    field::FieldShape,
    kernels::shared::{FLAG_GUIDED, FLAG_MAP, FLAG_MASK, FLAG_POSE},
    map::{
        Batch, FrameFormat, HAS_SAMPLE_HEAD, Map, Rates, Scratch, SemanticSupervision, fusion,
        passes, suppressor,
    },
};
use mte_slam_types::{
    camera::Camera,
    frame::{Bounds, Frame},
    pose::Pose,
};
use pollster::block_on;
use serde::Serialize;
use std::{fmt::Write, time::Instant};

/// Size of the scene \[m\].
const SIZE_M: DVec3 = DVec3::new(5.3, 2.9, 2.9);
const CLASSES: u32 = 52;
const CAMERA: Camera =
    Camera { width: 320, height: 240, fx: 200.0, fy: 200.0, cx: 159.5, cy: 119.5 };
const DEPTH_UNIT_M: f64 = 0.001;
/// Frames of the mapping window.
const WINDOW: u32 = 5;
/// Slots 1..=WINDOW hold the window; slot 0 has no images.
const FIRST_SLOT: u32 = 1;

#[derive(Serialize)]
struct Stage {
    kernel: String,
    ms: f64,
    dispatches: usize,
}

#[derive(Serialize)]
struct Measured {
    rays: u32,
    samples_per_ray: u32,
    ms_per_iteration: f64,
    stages: Vec<Stage>,
}

/// Kernels on the way from the semantic planes to a class, with a head of either kind.
const TO_CLASS: &[&str] =
    &["composite", "decode_rays", "sample_features", "matrix_product", "sample_logits"];
/// Those and what training adds. The per-sample head also scatters by `scatter_geometry`.
const TRAINING: [&str; 9] = [
    "composite",
    "decode_rays",
    "sample_features",
    "matrix_product",
    "sample_logits",
    "scatter_surface",
    "weight_gradient",
    "reduce_partials",
    "adam",
];

/// Time that classes take in a batch of rays.
#[derive(Clone, Copy, Serialize)]
struct ClassTime {
    /// From planes to the class \[ms\].
    to_class_ms: f64,
    /// The same with all gradients and Adam \[ms\].
    training_ms: f64,
}

/// The semantic path of both heads, in the same run.
#[derive(Serialize)]
struct SemanticPath {
    rays: u32,
    samples_per_ray: u32,
    rounds: usize,
    once_per_ray: ClassTime,
    every_sample: ClassTime,
    ratio_to_class: f64,
    ratio_training: f64,
}

/// What fusion and suppressor add to a call of mapping.
#[derive(Serialize)]
struct Modules {
    /// Iterations of a call.
    iterations: u32,
    /// The call without modules \[ms\].
    call_ms: f64,
    /// Training steps of the fusion in a call.
    fusion_steps: u32,
    /// One of them \[ms\].
    fusion: Measured,
    /// An update of the anchors, of which every iteration has one, and a maintenance, of which a call
    /// has one \[ms\].
    suppressor: Measured,
    /// All of it over the call.
    ratio: f64,
    /// Dispatches of the call without modules, and those of the modules: what counts where a GPU is
    /// not full.
    dispatches: [usize; 2],
}

/// Which iteration.
#[derive(Clone, Copy)]
enum Kind {
    Tracking,
    Mapping,
    /// The forward half of mapping.
    Classes,
    /// A training step of the fusion.
    Fusion,
    /// An update of the anchors, and their maintenance.
    Suppressor,
}

/// Measures.
pub fn run(args: &BenchArgs, screen: Screen) -> Result<()> {
    let chosen = engine::start(&args.engine)?;
    screen.note(&chosen.note);
    let mut config = Config::preset("replica").context("there is no preset `replica`")?;
    (config.mapping.rays, config.tracking.render_rays) = (4000, 2000);
    (config.sampling.stratified, config.sampling.surface) = (32, 8);
    let mut bench = set_up(chosen.engine, &config, CLASSES)?;
    let tracking = measure(&mut bench, &config, Kind::Tracking, args.iterations, screen)?;
    let mapping = measure(&mut bench, &config, Kind::Mapping, args.iterations, screen)?;
    let modules = measure_modules(&mut bench, &config, &mapping, args.iterations, screen)?;
    let (points, align_ms) = measure_align(&mut bench, &config, args.iterations)?;
    let bytes = bench.engine.allocated_bytes();
    drop(bench);
    let semantic = (HAS_SAMPLE_HEAD && !args.no_baseline)
        .then(|| measure_semantic_path(&config, &args.engine, args.iterations, screen))
        .transpose()?;

    let mut text = format!(
        "{}\nbound {} x {} x {} m, three modalities of 16 channels, {CLASSES} classes, {} MiB of \
         buffers; mean of {} iterations\n",
        chosen.note,
        SIZE_M.x,
        SIZE_M.y,
        SIZE_M.z,
        bytes >> 20,
        args.iterations
    );
    describe(&mut text, "tracking (render)", &tracking);
    describe(&mut text, "mapping", &mapping);
    describe(&mut text, "fusion, a training step", &modules.fusion);
    describe(&mut text, "suppressor, an update and a maintenance", &modules.suppressor);
    let _ = writeln!(
        text,
        "\na mapping call of {} iterations: {:.1} ms; {} fusion steps, the updates of the anchors \
         and a maintenance add {:.1} %, and {} dispatches to {}",
        modules.iterations,
        modules.call_ms,
        modules.fusion_steps,
        100.0 * modules.ratio,
        modules.dispatches[1],
        modules.dispatches[0],
    );
    let _ = writeln!(
        text,
        "\ntracking (align), {points} points: {align_ms:.2} ms per iteration, with reading back"
    );
    if let Some(semantic) = &semantic {
        describe_semantic_path(&mut text, semantic);
    } else if !HAS_SAMPLE_HEAD {
        text += "\nsemantic path: a build with the feature `sample-head` compares two heads\n";
    }
    let json = serde_json::json!({
        "engine": chosen.record,
        "iterations": args.iterations,
        "device_bytes": bytes,
        "tracking_render": tracking,
        "mapping": mapping,
        "modules": modules,
        "semantic_path": semantic,
        "tracking_align": { "points": points, "ms_per_iteration": align_ms },
    });
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}

fn describe(text: &mut String, name: &str, m: &Measured) {
    let (rays, samples) = (m.rays, m.samples_per_ray);
    let size = if rays > 0 { format!(", {rays} x {samples}") } else { String::new() };
    let _ = writeln!(text, "\n{name}{size}: {:.2} ms per iteration", m.ms_per_iteration);
    let sum: f64 = m.stages.iter().map(|s| s.ms).sum();
    for s in &m.stages {
        let _ = writeln!(text, "  {:22}{:9.2} ms {:5.1} %", s.kernel, s.ms, 100.0 * s.ms / sum);
    }
}

fn describe_semantic_path(text: &mut String, semantic: &SemanticPath) {
    let _ = writeln!(
        text,
        "\nsemantic path, {} x {}, {CLASSES} classes: what classes add, median of {} rounds\n  \
         {:22}{:>12}{:>22}",
        semantic.rays,
        semantic.samples_per_ray,
        semantic.rounds,
        "head",
        "to class",
        "with gradients, Adam"
    );
    for (name, t) in
        [("once per ray", semantic.once_per_ray), ("on every sample", semantic.every_sample)]
    {
        let _ = writeln!(text, "  {name:22}{:9.2} ms{:19.2} ms", t.to_class_ms, t.training_ms);
    }
    let _ = writeln!(
        text,
        "  {:22}{:>12}{:>22}",
        "ratio",
        format!("1 / {:.1}", 1.0 / semantic.ratio_to_class),
        format!("1 / {:.1}", 1.0 / semantic.ratio_training)
    );
}

/// A map on an engine.
struct Bench {
    engine: Engine,
    map: Map,
    scratch: Scratch,
}

fn set_up(mut engine: Engine, config: &Config, classes: u32) -> Result<Bench> {
    let bounds = Bounds { min: SIZE_M * -0.5, max: SIZE_M * 0.5 };
    let shape = FieldShape::new(bounds, &config.field);
    let format =
        FrameFormat { camera: CAMERA, depth_unit_m: DEPTH_UNIT_M, classes, feature_channels: 0 };
    let failed = "the benchmark's map cannot be set up";
    let map = Map::new(&mut engine, config, &format, shape).context(failed)?;
    let scratch = Scratch::new(&mut engine, config, &map).context(failed)?;
    let mut r = Commands::default();
    for k in 0..WINDOW {
        let pose = Pose::from_twist(&[0.1 * f64::from(k), 0.0, 0.0, 0.0, 0.3 * f64::from(k), 0.0]);
        map.frames.upload_frame(&mut r, FIRST_SLOT + k, &box_frame(&pose));
        map.frames.upload_pose(&mut r, FIRST_SLOT + k, &pose);
    }
    engine.submit(&r)?;
    Ok(Bench { engine, map, scratch })
}

/// A view of the box's inside from `pose`: checkers of colour and class.
fn box_frame(pose: &Pose) -> Frame {
    let half = SIZE_M * 0.45;
    let pixels = (0..CAMERA.height).flat_map(|v| (0..CAMERA.width).map(move |u| (u, v)));
    let mut frame = Frame {
        features: None,
        index: 0,
        number: 0,
        time_s: 0.0,
        color: Vec::with_capacity(CAMERA.pixels()),
        depth: Vec::with_capacity(CAMERA.pixels()),
        labels: None,
        truth: Some(*pose),
    };
    let mut labels = Vec::with_capacity(CAMERA.pixels());
    for (u, v) in pixels {
        let ray = pose.transform_vector(CAMERA.back_project(f64::from(u), f64::from(v), 1.0));
        let exit = |k: usize| (half[k].copysign(ray[k]) - pose.translation[k]) / ray[k];
        let depth_m = (0..3).map(exit).filter(|d| d.is_finite()).fold(f64::INFINITY, f64::min);
        let cell = ((pose.translation + ray * depth_m) * 2.0).floor();
        let n = (cell.x * 7.0 + cell.y * 3.0 + cell.z * 5.0).rem_euclid(f64::from(CLASSES)) as u8;
        frame.color.push([n * 4, 255 - n * 4, 128]);
        frame.depth.push((depth_m / DEPTH_UNIT_M) as u16);
        labels.push(n);
    }
    frame.labels = Some(labels);
    frame
}

fn record(
    bench: &mut Bench,
    config: &Config,
    kind: Kind,
    iteration: u32,
    r: &mut Commands,
) -> (u32, u32) {
    let Bench { map, scratch, .. } = bench;
    let s = &config.sampling;
    let (frames, rays, flags, loss) = match kind {
        Kind::Tracking => {
            let flags = FLAG_GUIDED | FLAG_POSE | FLAG_MASK;
            (1, config.tracking.render_rays, flags, &config.tracking.render_loss)
        }
        Kind::Mapping => {
            let flags = FLAG_GUIDED | FLAG_POSE | FLAG_MAP;
            (WINDOW, config.mapping.rays, flags, &config.loss)
        }
        Kind::Classes => (WINDOW, config.mapping.rays, FLAG_GUIDED, &config.loss),
        Kind::Fusion => {
            let slot = FIRST_SLOT + iteration % WINDOW;
            fusion::record_step(r, map, scratch, slot, config.mapping.rate_decoders);
            return (0, 0);
        }
        // The rays are those of the mapping iteration before.
        Kind::Suppressor => (WINDOW, config.mapping.rays, FLAG_GUIDED | FLAG_MAP, &config.loss),
    };
    let batch = Batch {
        frames,
        rays_per_frame: rays / frames,
        stratified: s.stratified,
        surface: s.surface,
        flags,
        loss,
        iteration,
        first: 0,
        camera: None,
        rare_share: 0.0,
        supervision: SemanticSupervision::default(),
    };
    if let Kind::Suppressor = kind {
        suppressor::record_update(r, map, scratch, &batch);
        suppressor::record_maintenance(r, map, scratch, &batch);
        return (0, 0);
    }
    passes::record_forward(r, map, scratch, &batch);
    if let Kind::Classes = kind {
        return (rays, s.stratified + s.surface);
    }
    passes::record_backward(r, map, scratch, &batch);
    let m = &config.mapping;
    let (v, w) = (m.rate_translation_m, m.rate_rotation_rad);
    passes::record_pose_step(r, map, scratch, &batch, v, w, iteration == 0);
    if let Kind::Mapping = kind {
        let rates = Rates { planes: m.rate_planes, decoders: m.rate_decoders };
        passes::record_step(r, map, scratch, &batch, rates);
    }
    (rays, s.stratified + s.surface)
}

fn measure(
    bench: &mut Bench,
    config: &Config,
    kind: Kind,
    iterations: usize,
    screen: Screen,
) -> Result<Measured> {
    let name = match kind {
        Kind::Tracking => "tracking",
        Kind::Mapping | Kind::Classes => "mapping",
        Kind::Fusion => "fusion",
        Kind::Suppressor => "suppressor",
    };
    let mut progress = screen.progress(name, 2 * iterations);
    let window: Vec<(u32, bool)> = (FIRST_SLOT..FIRST_SLOT + WINDOW)
        .map(|slot| (slot, !matches!(kind, Kind::Tracking) && slot == FIRST_SLOT))
        .collect();
    let mut r = Commands::default();
    bench.scratch.upload_window(&mut r, &window);
    // Warm up: pipelines are compiled on first use.
    let (rays, samples_per_ray) = record(bench, config, kind, 0, &mut r);
    bench.engine.submit(&r)?;
    block_on(bench.engine.synchronise())?;

    let begin = Instant::now();
    let mut r = Commands::default();
    for i in 0..iterations {
        record(bench, config, kind, i as u32 + 1, &mut r);
        // As a run does: a few iterations a submission.
        if i % 4 == 3 || i + 1 == iterations {
            bench.engine.submit(&std::mem::take(&mut r))?;
        }
    }
    block_on(bench.engine.synchronise())?;
    let ms_per_iteration = ms_since(begin) / iterations as f64;
    progress.set(iterations as u64, String::new);

    let mut stages: Vec<Stage> = Vec::new();
    for i in 0..iterations {
        let mut r = Commands::default();
        record(bench, config, kind, (iterations + i) as u32 + 1, &mut r);
        for command in r.list {
            let Command::Dispatch { kernel, .. } = &command else {
                bench.engine.submit(&Commands { list: vec![command] })?;
                continue;
            };
            let kernel = kernel.interface.name;
            let begin = Instant::now();
            bench.engine.submit(&Commands { list: vec![command] })?;
            block_on(bench.engine.synchronise())?;
            let ms = ms_since(begin) / iterations as f64;
            match stages.iter_mut().find(|s| s.kernel == kernel) {
                Some(stage) => {
                    stage.ms += ms;
                    stage.dispatches += usize::from(i == 0);
                }
                None => stages.push(Stage { kernel: kernel.to_owned(), ms, dispatches: 1 }),
            }
        }
        progress.set((iterations + i) as u64 + 1, String::new);
    }
    progress.finish();
    Ok(Measured { rays, samples_per_ray, ms_per_iteration, stages })
}

/// The modules' parts, after a measured mapping iteration on the same device.
fn measure_modules(
    bench: &mut Bench,
    config: &Config,
    mapping: &Measured,
    iterations: usize,
    screen: Screen,
) -> Result<Modules> {
    let suppressor = measure(bench, config, Kind::Suppressor, iterations, screen)?;
    let fusion = measure(bench, config, Kind::Fusion, iterations, screen)?;
    let (mapping_iterations, steps) = (config.mapping.iterations, config.fusion.steps);
    let call_ms = mapping.ms_per_iteration * f64::from(mapping_iterations);
    let stage = |m: &Measured, name: &str| -> f64 {
        m.stages.iter().filter(|s| s.kernel == name).map(|s| s.ms).sum()
    };
    let dispatches = |m: &Measured| -> usize { m.stages.iter().map(|s| s.dispatches).sum() };
    let added = fusion.ms_per_iteration * f64::from(steps)
        + stage(&suppressor, "update_anchors") * f64::from(mapping_iterations)
        + stage(&suppressor, "maintain_anchors");
    Ok(Modules {
        iterations: mapping_iterations,
        call_ms,
        fusion_steps: steps,
        ratio: added / call_ms,
        dispatches: [
            dispatches(mapping) * mapping_iterations as usize,
            dispatches(&fusion) * steps as usize + mapping_iterations as usize + 1,
        ],
        fusion,
        suppressor,
    })
}

/// Three maps: without classes, with a head once per ray, with one on every sample.
fn measure_semantic_path(
    config: &Config,
    engine: &EngineArgs,
    iterations: usize,
    screen: Screen,
) -> Result<SemanticPath> {
    // The per-sample head takes seconds a round on a processor.
    let rounds = iterations.min(5);
    let mut progress = screen.progress("semantic path", rounds);
    let mut benches = Vec::new();
    let (mut rays, mut samples_per_ray) = (0, 0);
    for (classes, head) in [(0, Head::Ray), (CLASSES, Head::Ray), (CLASSES, Head::Sample)] {
        let mut config = config.clone();
        config.semantics.head = head;
        let mut bench = set_up(engine::start(engine)?.engine, &config, classes)?;
        // A whole iteration compiles pipelines and fills the buffers that the parts read.
        let mut r = Commands::default();
        let window: Vec<_> = (FIRST_SLOT..FIRST_SLOT + WINDOW).map(|slot| (slot, true)).collect();
        bench.scratch.upload_window(&mut r, &window);
        (rays, samples_per_ray) = record(&mut bench, &config, Kind::Mapping, 0, &mut r);
        bench.engine.submit(&r)?;
        block_on(bench.engine.synchronise())?;
        benches.push((bench, config));
    }
    // Without classes, with each head; for training, without classes twice: each head is compared
    // with the kernels that it uses.
    let mut times: [Vec<f64>; 7] = Default::default();
    let scattering = [TRAINING.as_slice(), &["scatter_geometry"]].concat();
    let plan: [(usize, bool, &[&str]); 7] = [
        (0, false, TO_CLASS),
        (1, false, TO_CLASS),
        (2, false, TO_CLASS),
        (0, true, &TRAINING),
        (1, true, &TRAINING),
        (0, true, &scattering),
        (2, true, &scattering),
    ];
    for round in 0..rounds {
        for (times, (which, train, kernels)) in times.iter_mut().zip(&plan) {
            let (bench, config) = &mut benches[*which];
            let mut r = Commands::default();
            let kind = if *train { Kind::Mapping } else { Kind::Classes };
            record(bench, config, kind, round as u32 + 1, &mut r);
            r.list.retain(|command| match command {
                Command::Dispatch { kernel, .. } => kernels.contains(&kernel.interface.name),
                _ => true,
            });
            let begin = Instant::now();
            bench.engine.submit(&r)?;
            block_on(bench.engine.synchronise())?;
            times.push(ms_since(begin));
        }
        progress.set(round as u64 + 1, String::new);
    }
    progress.finish();
    let median = times.map(|mut t| {
        t.sort_by(f64::total_cmp);
        t[t.len() / 2]
    });
    let time = |class: [usize; 2], training: [usize; 2]| ClassTime {
        to_class_ms: (median[class[1]] - median[class[0]]).max(0.0),
        training_ms: (median[training[1]] - median[training[0]]).max(0.0),
    };
    let (once_per_ray, every_sample) = (time([0, 1], [3, 4]), time([0, 2], [5, 6]));
    Ok(SemanticPath {
        rays,
        samples_per_ray,
        rounds,
        once_per_ray,
        every_sample,
        ratio_to_class: once_per_ray.to_class_ms / every_sample.to_class_ms,
        ratio_training: once_per_ray.training_ms / every_sample.training_ms,
    })
}

/// One Gauss-Newton iteration against the field: sums of the normal equations, read back.
fn measure_align(bench: &mut Bench, config: &Config, iterations: usize) -> Result<(usize, f64)> {
    let frame = box_frame(&Pose::IDENTITY);
    let step = CAMERA.pixels().div_ceil(config.tracking.align_pixels as usize);
    let points: Vec<[f32; 4]> = (0..CAMERA.pixels())
        .step_by(step)
        .map(|i| {
            let (u, v) = (i as u32 % CAMERA.width, i as u32 / CAMERA.width);
            let depth_m = f64::from(frame.depth[i]) * DEPTH_UNIT_M;
            let p = CAMERA.back_project(f64::from(u), f64::from(v), depth_m);
            [p.x as f32, p.y as f32, p.z as f32, f32::from(frame.color[i][0]) / 255.0]
        })
        .collect();
    let mut r = Commands::default();
    let Bench { engine, map, scratch } = bench;
    passes::upload_pixels(&mut r, scratch, &points);
    engine.submit(&r)?;
    let count = points.len() as u32;
    block_on(passes::align(engine, map, scratch, &Pose::IDENTITY, count))?;
    let begin = Instant::now();
    for _ in 0..iterations {
        block_on(passes::align(engine, map, scratch, &Pose::IDENTITY, count))?;
    }
    Ok((points.len(), ms_since(begin) / iterations as f64))
}

fn ms_since(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1000.0
}
