//! A run that is interrupted ends with the same bytes as one that is not, and what does not fit is
//! refused with its reason.
use mte_slam_core::{
    config::{Config, Tracker},
    engine::{Engine, EngineError},
    slam::{Checkpoint, Slam, SlamError},
};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_tests::gpu_engine;
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};
use pollster::block_on;

/// A recording in memory.
struct Recorded {
    info: SequenceInfo,
    frames: Vec<Frame>,
}

impl Recorded {
    fn new(width: u32, frames: usize) -> Recorded {
        let height = width / 4 * 3;
        let options = SyntheticOptions { width, height, frames, ..SyntheticOptions::tiny() };
        let mut sequence = SyntheticSequence::new(options);
        // Some steps between frames, so that there is something to track.
        let frames = (0..frames).map(|i| sequence.frame(i).unwrap()).collect();
        Recorded { info: sequence.info().clone(), frames }
    }
}

fn small(tracker: Tracker) -> Config {
    let mut config = Config { seed: 5, ..Config::default() };
    config.tracking.tracker = tracker;
    config.tracking.align_pixels = 512;
    (config.tracking.render_rays, config.tracking.render_iterations) = (128, 2);
    config.mapping.every = 2;
    config.mapping.rays = 400;
    (config.mapping.first_iterations, config.mapping.iterations) = (60, 4);
    (config.mapping.final_iterations, config.mapping.semantic_iterations) = (22, 22);
    (config.sampling.stratified, config.sampling.surface) = (12, 4);
    (config.fusion.weight, config.suppressor.weight) = (0.02, 0.01);
    (config.suppressor.start, config.suppressor.ramp) = (1, 2);
    config.suppressor.settle_share = 1.0;
    config.mesh.min_component_triangles = 1;
    config
}

/// All that comes out of a run.
fn outcome(slam: &mut Slam, recorded: &Recorded) -> (Vec<u8>, Vec<u32>) {
    let bytes = block_on(slam.checkpoint()).unwrap().to_bytes();
    let pose = slam.trajectory()[1].world_from_camera;
    let view = block_on(slam.render(&pose, &recorded.info.camera)).unwrap();
    let mesh = block_on(slam.extract_mesh(0.2, &mut |_| {})).unwrap();
    assert!(!mesh.triangles.is_empty(), "there is a map");
    let mut seen: Vec<u32> = view.depth_m.iter().map(|d| d.to_bits()).collect();
    seen.extend(view.color.iter().flatten().chain(&view.class).map(|b| u32::from(*b)));
    seen.extend(mesh.positions.iter().flatten().map(|x| x.to_bits()));
    (bytes, seen)
}

fn complete(slam: &mut Slam, recorded: &Recorded) {
    for frame in &recorded.frames[slam.next_frame()..] {
        block_on(slam.process(frame)).unwrap();
    }
    block_on(slam.finish()).unwrap();
}

/// Through the bytes of a file, on another engine.
fn resumed(bytes: &[u8], engine: Engine, config: &Config, recorded: &Recorded) -> Slam {
    let checkpoint = Checkpoint::from_bytes(bytes).unwrap();
    let mut resuming =
        block_on(Slam::resume(engine, config.clone(), &recorded.info, &checkpoint)).unwrap();
    for index in resuming.missing().collect::<Vec<usize>>() {
        resuming.add(&recorded.frames[index]).unwrap();
    }
    let mut slam = resuming.finish().unwrap();
    let again = block_on(slam.checkpoint()).unwrap().to_bytes();
    assert!(again == bytes, "a checkpoint of what was just resumed is the same checkpoint");
    slam
}

/// Interrupts a run after each of its frames and each part of its last optimisation.
fn interrupt_everywhere(config: &Config, recorded: &Recorded) {
    let new = || block_on(Slam::new(Engine::cpu(), config.clone(), &recorded.info)).unwrap();
    let mut whole = new();
    complete(&mut whole, recorded);
    let end = outcome(&mut whole, recorded);

    let mut slam = new();
    let mut saved = Vec::new();
    for frame in &recorded.frames {
        block_on(slam.process(frame)).unwrap();
        saved.push(block_on(slam.checkpoint()).unwrap().to_bytes());
        slam = resumed(saved.last().unwrap(), Engine::cpu(), config, recorded);
    }
    let mut parts = 0;
    while block_on(slam.finish_step()).unwrap() {
        parts += 1;
        let bytes = block_on(slam.checkpoint()).unwrap().to_bytes();
        slam = resumed(&bytes, Engine::cpu(), config, recorded);
    }
    assert!(parts >= 1, "the last optimisation was interrupted, too");
    assert!(outcome(&mut slam, recorded) == end, "interrupted everywhere");

    // What a chain might cancel out: one interruption alone.
    let middle = &saved[recorded.frames.len() / 2];
    let mut slam = resumed(middle, Engine::cpu(), config, recorded);
    complete(&mut slam, recorded);
    assert!(outcome(&mut slam, recorded) == end, "interrupted once");
}

#[test]
fn align_with_labels_fusion_and_anchors() {
    let recorded = Recorded::new(64, 7);
    let config = small(Tracker::Align);
    assert!(config.fusion.enabled && config.suppressor.enabled);
    interrupt_everywhere(&config, &recorded);
}

#[test]
fn render_with_poses_refined_in_the_map() {
    let mut config = small(Tracker::Render);
    config.mapping.every = 1;
    config.keyframes.every = 1;
    config.field.use_given_bounds = false;
    // Poses are refined with more than four keyframes.
    interrupt_everywhere(&config, &Recorded::new(64, 8));
}

#[test]
fn keyframes_that_were_dropped_leave_their_slots_behind() {
    let mut recorded = Recorded::new(160, 9);
    let mut config = small(Tracker::Truth);
    (config.mapping.every, config.keyframes.every, config.keyframes.budget_mib) = (1, 1, 1);
    let slots = (1 << 20) / (160 * 120 * 6 + 20 * 15 * 80);
    assert!(slots < recorded.frames.len(), "{slots} slots must not hold every frame");
    interrupt_everywhere(&config, &recorded);
    // Without labels, in a map that grows.
    recorded.info.classes = Default::default();
    recorded.frames.iter_mut().for_each(|f| f.labels = None);
    config.field.use_given_bounds = false;
    interrupt_everywhere(&config, &recorded);
}

#[test]
fn a_lost_graphics_device_is_survived_on_another_one() {
    let Some(engine) = gpu_engine() else { return };
    let break_it = engine.breaker().expect("a GPU engine");
    let recorded = Recorded::new(64, 5);
    let mut config = small(Tracker::Align);
    config.mapping.final_iterations = 4;
    config.mapping.semantic_iterations = 4;
    let mut slam = block_on(Slam::new(engine, config.clone(), &recorded.info)).unwrap();
    let mut saved = Vec::new();
    for frame in &recorded.frames {
        block_on(slam.process(frame)).unwrap();
        if frame.index == 2 {
            saved = block_on(slam.checkpoint()).unwrap().to_bytes();
        }
    }
    block_on(slam.finish()).unwrap();
    let end = outcome(&mut slam, &recorded);

    break_it();
    let pose = slam.trajectory()[0].world_from_camera;
    let lost = block_on(slam.render(&pose, &recorded.info.camera)).unwrap_err();
    let SlamError::Engine(error) = &lost else { panic!("{lost}") };
    assert!(matches!(error, EngineError::DeviceLost { .. }) && error.is_device_failure(), "{lost}");
    assert!(block_on(slam.checkpoint()).is_err(), "nothing can be saved any more");
    drop(slam);

    let Some(engine) = gpu_engine() else { return };
    let mut slam = resumed(&saved, engine, &config, &recorded);
    complete(&mut slam, &recorded);
    assert!(outcome(&mut slam, &recorded) == end);
    // The other engine takes it over as well, if not with the same rounding.
    let mut slam = resumed(&saved, Engine::cpu(), &config, &recorded);
    complete(&mut slam, &recorded);
    assert_eq!(slam.trajectory().len(), recorded.frames.len());
}

#[test]
fn what_does_not_fit_is_refused_with_its_reason() {
    let recorded = Recorded::new(64, 3);
    let config = small(Tracker::Align);
    let mut slam = block_on(Slam::new(Engine::cpu(), config.clone(), &recorded.info)).unwrap();
    assert!(matches!(block_on(slam.checkpoint()), Err(SlamError::NoMap)));
    for frame in &recorded.frames[..2] {
        block_on(slam.process(frame)).unwrap();
    }
    let saved = block_on(slam.checkpoint()).unwrap();
    let refused = |config: &Config, info: &SequenceInfo, saved: &Checkpoint, parts: &[&str]| {
        let resumed = block_on(Slam::resume(Engine::cpu(), config.clone(), info, saved));
        let message = resumed.err().expect("an error").to_string();
        assert!(parts.iter().all(|p| message.contains(p)), "{parts:?} in {message}");
    };
    let (info, whole) = (&recorded.info, &saved);

    let mut other = config.clone();
    other.mapping.rays = 401;
    let parts = ["configuration.mapping.rays", "found 401", "expected 400"];
    refused(&other, info, whole, &parts);
    let mut fewer = info.clone();
    fewer.frames = 2;
    refused(&config, &fewer, whole, &["sequence.frames", "found 2", "expected 3"]);
    let mut wider = info.clone();
    wider.camera.fx += 1e-9;
    refused(&config, &wider, whole, &["sequence.camera.fx"]);
    let mut renamed = info.clone();
    renamed.name = "the same in another folder".into();
    assert!(block_on(Slam::resume(Engine::cpu(), config.clone(), &renamed, whole)).is_ok());

    let with = |key: &str, from: &str, to: &str| {
        let mut changed = saved.clone();
        let entry = changed.metadata.get_mut(key).unwrap();
        assert!(entry.contains(from), "{from} in {key}");
        *entry = entry.replacen(from, to, 1);
        changed
    };
    let parts = ["format", "mte-slam-5", "mte-slam-6"];
    refused(&config, info, &with("format", "mte-slam-6", "mte-slam-5"), &parts);
    refused(&config, info, &with("state", "\"seed\":5", "\"seed\":6"), &["configuration"]);
    refused(&config, info, &with("state", "\"free_slots\":[", "\"free_slots\":[1,"), &["slots"]);
    refused(
        &config,
        info,
        &with("state", "\"mapping_calls\":", "\"mapping_calls\":200000000"),
        &["counters"],
    );
    refused(&config, info, &with("state", "\"next_id\":", "\"next_id\":7"), &["odometer"]);
    refused(&config, info, &with("state", "\"slots\":", "\"no_slots\":"), &["state", "slots"]);
    let mut without = saved.clone();
    without.tensors.retain(|t| t.name != "planes.semantic.moment2");
    refused(&config, info, &without, &["planes.semantic.moment2", "nothing"]);
    let mut shorter = saved.clone();
    shorter.tensors[0].bytes.truncate(400);
    refused(&config, info, &shorter, &["planes.geometry.values", "400 bytes"]);
    let mut broken = saved.clone();
    broken.tensors[1].bytes[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    refused(&config, info, &broken, &["planes.geometry.moment1", "finite"]);
    let mut hashes = saved.clone();
    let hash = hashes.tensors.iter_mut().find(|t| t.name == "frames.hash").unwrap();
    hash.bytes[0] ^= 1;
    refused(&config, info, &hashes, &["data"]);
    let bytes = saved.to_bytes();
    for cut in [0, 7, 100, bytes.len() / 2, bytes.len() - 1] {
        assert!(Checkpoint::from_bytes(&bytes[..cut]).is_err(), "{cut}");
    }

    let resume = || block_on(Slam::resume(Engine::cpu(), config.clone(), info, whole)).unwrap();
    let mut resuming = resume();
    let missing: Vec<usize> = resuming.missing().collect();
    assert_eq!(missing, [0, 1], "keyframes and the last frame");
    let mut other = recorded.frames[0].clone();
    other.color[17][1] ^= 1;
    let message = resuming.add(&other).unwrap_err().to_string();
    assert!(message.contains("frame 0") && message.contains("same recording"), "{message}");
    assert!(resuming.add(&recorded.frames[2]).is_err(), "a frame that nobody asked for");
    resuming.add(&recorded.frames[0]).unwrap();
    let message = resuming.finish().err().unwrap().to_string();
    assert!(message.contains("frame 1 is missing"), "{message}");

    let mut shown = block_on(Slam::restore(Engine::cpu(), whole)).unwrap();
    let (pose, camera) = (shown.trajectory()[0].world_from_camera, info.camera);
    let seen = |s: &mut Slam| block_on(s.render(&pose, &camera)).unwrap().depth_m;
    assert!(seen(&mut shown) == seen(&mut slam), "a map that is shown is the map");
    let message = block_on(shown.process(&recorded.frames[2])).unwrap_err().to_string();
    assert!(message.contains("restored to be shown"), "{message}");
    assert!(block_on(shown.checkpoint()).is_err());
}
