//! Feature fusion and redundancy suppressor through the passes over a map: analytic gradients
//! against central differences, where a patch of the image shows up, what the losses move, and
//! settings that are refused.
mod patches;

use mte_slam_core::{
    commands::{BufferId, Commands},
    config::{Config, FusionConfig, LossConfig},
    engine::Engine,
    kernels::{
        shared::{FLAG_ANCHORS, FLAG_DENSE, FLAG_GUIDED, FLAG_MAP},
        tokens::{COLOR_AT, NO_BIAS, SEMANTIC_AT},
    },
    layout::{ANCHOR_FLOATS, HEAD_FLOATS, RAY_OUT_FLOATS, RAY_STATE_FLOATS, STATE_ANCHOR},
    map::{Batch, ClassWeight, Rates, SemanticSupervision},
    shaders::decoders::SEMANTIC,
};
use mte_slam_tests::{
    TestRandom, f32_words,
    fixture::{self, CLASSES, FRAMES, Options, State},
    rig::Rig,
};
use mte_slam_types::frame::FeatureMap;
use std::{collections::BTreeSet, ops::Range};

const RAYS_PER_FRAME: u32 = 60;
const SLOT: u32 = 1;
const WINDOW: [(u32, bool); 3] = [(2, true), (0, true), (1, true)];

fn config(fusion: FusionConfig) -> Config {
    let mut c = Config { field: fixture::field_config(), fusion, ..Config::default() };
    c.field.sharpness = 4.0;
    (c.sampling.stratified, c.sampling.surface) = (12, 4);
    c.sampling.min_weight = 0.0;
    (c.mapping.rays, c.tracking.render_rays) = (FRAMES * RAYS_PER_FRAME, 1);
    c.keyframes.budget_mib = 1;
    c.suppressor.anchors = 16;
    c
}

/// A map with frames, random planes and decoders, and parameters of the fusion none of which is
/// 0: biases start there, and attention starts close to a mean.
fn device(engine: Engine, fusion: FusionConfig) -> Rig {
    device_with(engine, fusion, 0)
}

/// The same with feature maps of so many channels.
fn device_with(engine: Engine, fusion: FusionConfig, channels: u32) -> Rig {
    let camera = fixture::wide_camera();
    let (config, shape) = (config(fusion), fixture::shape());
    let mut d = Rig::new(engine, &config, camera, channels, shape);
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
        let mut frame = fixture::frame_of(&camera, slot);
        frame.features = (channels > 0).then(|| feature_map(channels as usize, slot));
        d.upload_frame(&mut r, slot, &frame);
        d.upload_pose(&mut r, slot, &fixture::pose(slot));
    }
    d.upload_window(&mut r, &WINDOW);
    let weights = [(1.0, 0.3), (0.5, -0.2), (2.0, 0.6), (1.5, 0.0), (0.75, -0.4)]
        .map(|(weight, adjustment)| ClassWeight { weight, adjustment });
    d.map.upload_class_weights(&mut r, &weights, &[1.0, 0.5, 2.0, 1.5, 0.75], &[0.0; 5]);
    d.submit(&r);
    let f = d.fusion.as_ref().unwrap();
    let (tensor, layers) = (f.parameters, f.layers.clone());
    let mut values = d.read(tensor.values, tensor.floats);
    let mut random = TestRandom(401);
    for layer in &layers {
        if layer.shape.bias != NO_BIAS {
            let biases =
                layer.shape.bias as usize..(layer.shape.bias + layer.shape.bias_count()) as usize;
            values[biases].fill_with(|| random.uniform(-0.2, 0.2));
        }
        if layer.name.starts_with(['Q', 'K']) {
            let weights = layer.shape.weights as usize
                ..(layer.shape.weights + layer.shape.weight_count()) as usize;
            values[weights].iter_mut().for_each(|w| *w *= 2.0);
        }
    }
    d.write(tensor.values, &values);
    d
}

/// A map of another size than the token grid, another one for each frame.
fn feature_map(channels: usize, slot: u32) -> FeatureMap {
    let (height, width) = (5, 8);
    let mut random = TestRandom(450 + u64::from(slot));
    let values = (0..channels * height * width).map(|_| random.uniform(-3.0, 3.0)).collect();
    FeatureMap { channels, height, width, values }
}

/// Mean over the tokens of the loss at F.
fn fusion_loss(d: &mut Rig) -> f64 {
    let mut r = Commands::new();
    d.record_fusion_backward(&mut r, SLOT);
    d.submit(&r);
    let (tokens, stride, count) = d.tokens();
    let tokens = d.read(tokens, count * stride);
    let column = tokens.iter().skip(COLOR_AT as usize + 3).step_by(stride);
    column.map(|x| f64::from(*x)).sum::<f64>() / count as f64
}

/// Compares a part of a tensor's gradient with differences of a loss: along the gradient, along
/// random signs of it, and at single parameters.
fn check(
    d: &mut Rig,
    buffer: impl Into<BufferId> + Copy,
    gradient: &[f32],
    part: Range<usize>,
    name: &str,
    loss: &mut dyn FnMut(&mut Rig) -> f64,
) {
    let values = d.read(buffer, gradient.len());
    let norm = part.clone().map(|i| gradient[i] * gradient[i]).sum::<f32>().sqrt();
    let largest = part.clone().map(|i| gradient[i].abs()).fold(0.0, f32::max);
    assert!(norm > 1e-4, "{name}: no gradient ({norm})");
    let nonzero = part.clone().filter(|i| gradient[*i] != 0.0).count();
    assert!(nonzero * 8 > part.len(), "{name}: {nonzero} of {} have one", part.len());

    // Small, for rectifiers of few tokens have their kinks: errors shrink with the step. Rounding
    // is still below some thousandths of what the loss changes by.
    let h = (2e-4 / norm).clamp(2e-4, 2e-3);
    let mut slope = |direction: &dyn Fn(usize) -> f32, h: f32| {
        let mut at = |h: f32| {
            let mut moved = values.clone();
            part.clone().for_each(|i| moved[i] += h * direction(i));
            d.write(buffer, &moved);
            loss(d)
        };
        (at(h) - at(-h)) / (2.0 * f64::from(h))
    };
    let mut random = TestRandom(9);
    let signs: Vec<f32> =
        gradient.iter().map(|_| if random.bits().is_multiple_of(2) { -1.0 } else { 1.0 }).collect();
    for (which, mixed) in [("gradient", false), ("mixed", true)] {
        let direction = |i: usize| if mixed { signs[i] } else { 1.0 } * gradient[i] / norm;
        let expected: f64 =
            part.clone().map(|i| f64::from(direction(i)) * f64::from(gradient[i])).sum();
        // Where a step crosses a kink, smaller ones come closer; a wrong gradient stays wrong.
        let mut found = Vec::new();
        let close = [1.0, 0.25, 0.0625].into_iter().any(|part| {
            found.push(slope(&direction, part * h));
            (found[found.len() - 1] - expected).abs() < 0.01 * f64::from(norm)
        });
        println!("{name} along {which}: {expected:.6} {found:.6?}, norm {norm:.6}");
        assert!(close, "{name} along {which}: {expected} analytic, {found:?} measured");
    }
    let mut order: Vec<usize> = part.clone().collect();
    order.sort_by(|a, b| gradient[*b].abs().total_cmp(&gradient[*a].abs()));
    let mut outliers = Vec::new();
    for i in order.iter().step_by((order.len() / 24).max(1)).take(8) {
        let found = slope(&|k| if k == *i { 1.0 } else { 0.0 }, 4.0 * h);
        let expected = f64::from(gradient[*i]);
        if (found - expected).abs() > 0.03 * expected.abs() + 0.005 * f64::from(largest) + 1e-5 {
            outliers.push((*i, expected, found));
        }
    }
    d.write(buffer, &values);
    assert!(outliers.len() <= 1, "{name}: {outliers:?}");
}

/// Every layer of the fusion and the class head it shares with the field.
fn fusion_gradients(fusion: FusionConfig) {
    let local = fusion.local;
    let mut d = device(Engine::cpu(), fusion);
    fusion_loss(&mut d);
    let f = d.fusion.as_ref().unwrap();
    let (tensor, layers) = (f.parameters, f.layers.clone());
    assert_eq!((f.grid.columns, f.grid.rows), (13, 7));
    let gradient = d.read(tensor.gradient, tensor.floats);
    for layer in layers {
        let weights = layer.shape.weights as usize
            ..(layer.shape.weights + layer.shape.weight_count()) as usize;
        if layer.name == "depthwise" && !local {
            assert!(gradient[weights].iter().all(|g| *g == 0.0), "nothing reads it");
            continue;
        }
        check(&mut d, tensor.values, &gradient, weights, layer.name, &mut fusion_loss);
        if layer.shape.bias != NO_BIAS {
            let biases =
                layer.shape.bias as usize..(layer.shape.bias + layer.shape.bias_count()) as usize;
            let name = format!("{}, biases", layer.name);
            check(&mut d, tensor.values, &gradient, biases, &name, &mut fusion_loss);
        }
    }
    let decoders = d.decoders;
    let gradient = d.read(decoders.gradient, decoders.floats);
    let bias = HEAD_FLOATS + CLASSES as usize * 16;
    for (name, part) in
        [("class head", HEAD_FLOATS..bias), ("class head, biases", bias..bias + CLASSES as usize)]
    {
        check(&mut d, decoders.values, &gradient, part, name, &mut fusion_loss);
    }
}

#[test]
fn gradients_of_the_fusion() {
    fusion_gradients(FusionConfig::default());
}

#[test]
fn gradients_of_the_projection_of_feature_maps() {
    let mut d = device_with(Engine::cpu(), FusionConfig::default(), 11);
    fusion_loss(&mut d);
    let f = d.fusion.as_ref().unwrap();
    let tensor = f.parameters;
    let layer = *f.layers.iter().find(|l| l.name == "feature projection").unwrap();
    let gradient = d.read(tensor.gradient, tensor.floats);
    let weights =
        layer.shape.weights as usize..(layer.shape.weights + layer.shape.weight_count()) as usize;
    check(&mut d, tensor.values, &gradient, weights, layer.name, &mut fusion_loss);
}

/// The fusion reads the map of the frame's own slot, on the token grid, in place of the labels.
#[test]
fn feature_maps_take_the_place_of_labels() {
    let channels = 11;
    let semantic = |relabel: bool, other: bool| {
        let mut d = device_with(Engine::cpu(), FusionConfig::default(), channels);
        let mut frame = fixture::frame_of(&fixture::wide_camera(), SLOT);
        frame.features = Some(feature_map(channels as usize, if other { 2 } else { SLOT }));
        if relabel {
            frame.labels.as_mut().unwrap().fill(1);
        }
        let mut r = Commands::new();
        d.upload_frame(&mut r, SLOT, &frame);
        d.record_fusion_forward(&mut r, SLOT);
        d.submit(&r);
        let f = d.fusion.as_ref().unwrap();
        let layer = *f.layers.iter().find(|l| l.name == "feature projection").unwrap();
        let parameters = f.parameters;
        let (tokens, stride, count) = d.tokens();
        let tokens = d.read(tokens, count * stride);
        let at = SEMANTIC_AT as usize;
        let rows = tokens.chunks_exact(stride);
        let s: Vec<f32> = rows.flat_map(|row| row[at..at + 16].to_vec()).collect();
        (s, d.read(parameters.values, parameters.floats), layer)
    };
    let (s, w, layer) = semantic(false, false);
    assert!(semantic(true, false).0 == s, "labels are not read");
    assert!(semantic(false, true).0 != s, "the map is");
    // 104 of the image's 109 columns of pixels are tokens, 56 of its 59 rows.
    let map = feature_map(channels as usize, SLOT).resampled(13, 7, [104.0 / 109.0, 56.0 / 59.0]);
    for (token, cell) in map.chunks_exact(channels as usize).enumerate() {
        for o in 0..16 {
            let weight = |i: usize| w[layer.shape.weights as usize + i * 16 + o];
            let expected: f32 = cell.iter().enumerate().map(|(i, x)| x * weight(i)).sum();
            let found = s[token * 16 + o];
            assert!((found - expected).abs() < 1e-4, "{token} {o}: {found} {expected}");
        }
    }
}

#[test]
fn gradients_of_the_widest_fusion() {
    fusion_gradients(FusionConfig {
        key_stride: 1,
        local_kernel: 3,
        gate_kernel: 3,
        ..FusionConfig::default()
    });
}

#[test]
fn gradients_of_the_plainest_fusion() {
    fusion_gradients(FusionConfig {
        key_stride: 3,
        residual: false,
        local: false,
        ..FusionConfig::default()
    });
}

const NO_LOSS: LossConfig = LossConfig {
    free_space: 0.0,
    centre: 0.0,
    tail: 0.0,
    depth: 0.0,
    color: 0.0,
    semantic: 0.0,
    balance: 0.0,
    adjustment: 0.0,
};

fn batch(compression: f64, feature: f64) -> Batch<'static> {
    Batch {
        frames: FRAMES,
        rays_per_frame: RAYS_PER_FRAME,
        stratified: 12,
        surface: 4,
        flags: FLAG_GUIDED | FLAG_MAP,
        loss: &NO_LOSS,
        iteration: 5,
        first: 0,
        camera: None,
        rare_share: 0.0,
        supervision: SemanticSupervision { compression, feature, ..SemanticSupervision::default() },
    }
}

/// A map with anchors (every fourth slot is free) and the fused features of all frames.
fn supervised() -> Rig {
    let mut d = device(Engine::cpu(), FusionConfig::default());
    let mut r = Commands::new();
    (0..FRAMES).for_each(|slot| d.record_fusion_forward(&mut r, slot));
    let mut random = TestRandom(411);
    let mut anchors = Vec::new();
    for i in 0..16 {
        anchors.extend(f32_words((0..16).map(|_| random.uniform(-0.5, 0.5))));
        anchors.push(if i % 4 == 3 { 255 } else { i % CLASSES });
        anchors.resize(anchors.len() + ANCHOR_FLOATS - 17, 0);
    }
    r.upload(d.suppressor.as_ref().unwrap().anchors, 0, &anchors);
    d.submit(&r);
    d
}

/// The weighted loss against anchors and fused features, mean over the rays.
fn ray_loss(d: &mut Rig, b: &Batch<'_>) -> f64 {
    let mut r = Commands::new();
    d.record_forward(&mut r, b);
    d.submit(&r);
    let rays = FRAMES * RAYS_PER_FRAME;
    let state = d.read_ray_state(rays);
    let column = state.iter().skip(STATE_ANCHOR as usize * 4 + 3).step_by(RAY_STATE_FLOATS);
    column.map(|x| f64::from(*x)).sum::<f64>() / f64::from(rays)
}

/// Classes of the rays of a forward pass: the head's, and those of the nearest anchors.
fn head_and_anchors(d: &mut Rig, iteration: u32) -> Vec<(u32, u32)> {
    let mut classes = Vec::new();
    for flags in [FLAG_GUIDED | FLAG_MAP, FLAG_GUIDED | FLAG_MAP | FLAG_ANCHORS] {
        let mut r = Commands::new();
        d.record_forward(&mut r, &Batch { flags, iteration, ..batch(0.0, 0.0) });
        d.submit(&r);
        let out = d.read_ray_out(FRAMES * RAYS_PER_FRAME);
        classes.push(out.chunks_exact(RAY_OUT_FLOATS).map(|r| r[5].to_bits()).collect::<Vec<_>>());
    }
    classes[0].iter().copied().zip(classes[1].iter().copied()).collect()
}

/// Labels every pixel as the head does.
fn label_as_the_head(d: &mut Rig) {
    let pixels = fixture::wide_camera().pixels() as u32;
    for slot in 0..FRAMES {
        let mut labelled = Vec::new();
        while labelled.len() < pixels as usize {
            let first = labelled.len() as u32;
            let rays_per_frame = d.scratch.max_rays.min(pixels - first);
            let flags = FLAG_DENSE | FLAG_GUIDED;
            let mut r = Commands::new();
            d.upload_window(&mut r, &[(slot, true)]);
            let b = Batch { frames: 1, rays_per_frame, first, flags, ..batch(0.0, 0.0) };
            d.record_forward(&mut r, &b);
            d.submit(&r);
            let out = d.read_ray_out(rays_per_frame);
            let class = |ray: &[f32]| [128, 128, 128, ray[5].to_bits() as u8];
            labelled.extend(out.chunks_exact(RAY_OUT_FLOATS).map(class));
        }
        let mut r = Commands::new();
        d.upload_color(&mut r, slot, &labelled);
        d.upload_window(&mut r, &WINDOW);
        d.submit(&r);
    }
}

/// Anchors that settle tell more and more rays the head's class, rays they have not seen as well;
/// classes of the head without an anchor get one if labels bear them out, here random ones do not;
/// and nothing but anchors changes.
#[test]
fn anchors_settle_by_the_heads_classes() {
    let untouched = |d: &mut Rig| {
        [d.semantic, d.decoders, d.appearance, d.geometry].map(|t| d.read(t.values, t.floats))
    };
    let agreement = |classes: &[(u32, u32)]| {
        classes.iter().filter(|(head, anchor)| head == anchor).count() as f64 / classes.len() as f64
    };
    let told = |classes: &[(u32, u32)]| classes.iter().map(|c| c.1).collect::<BTreeSet<u32>>();
    let settled = |borne_out: bool| {
        let mut d = supervised();
        if borne_out {
            label_as_the_head(&mut d);
        }
        let kept = untouched(&mut d);
        let before = head_and_anchors(&mut d, 999);
        for i in 0..60 {
            let b = Batch { iteration: i, ..batch(0.0, 0.0) };
            let mut r = Commands::new();
            d.record_forward(&mut r, &b);
            // With a rate that falls to 0, as at the end of a run.
            let rate = 0.3 * f64::from(60 - i) / 60.0;
            d.record_anchor_settling(&mut r, &b, rate, i == 0);
            d.submit(&r);
        }
        assert_eq!(kept, untouched(&mut d));
        (before, head_and_anchors(&mut d, 999))
    };
    let (before, after) = settled(true);
    let (_, without) = settled(false);
    let [first, last, least] = [&before, &after, &without].map(|c| agreement(c));
    println!("agreement {first:.3} before, {last:.3} and {least:.3} after");
    assert!(first < 0.8 && last > 0.9 && least > first, "{first} {last} {least}");
    let heads: BTreeSet<u32> = before.iter().map(|c| c.0).collect();
    assert_eq!(told(&after), heads);
    assert!(told(&without).len() < heads.len());
}

/// Compression loss, feature loss and both: semantic planes and decoder follow their gradients,
/// and nothing else has one.
#[test]
fn gradients_of_anchors_and_fused_features() {
    for (name, b) in
        [("anchors", batch(0.8, 0.0)), ("features", batch(0.0, 0.6)), ("both", batch(0.8, 0.6))]
    {
        let mut d = supervised();
        assert!(ray_loss(&mut d, &b) > 0.01, "{name}: no loss");
        // One step with rate 0: Adam's first moments are a tenth of the gradients afterwards.
        let mut r = Commands::new();
        d.record_forward(&mut r, &b);
        d.record_backward(&mut r, &b);
        d.record_step(&mut r, &b, Rates { planes: 0.0, decoders: 0.0 });
        d.submit(&r);
        assert_eq!(d.read_status(), 0, "saturated or not finite");
        let tensors = [d.geometry, d.appearance, d.semantic, d.decoders];
        let [geometry, appearance, semantic, decoders] = tensors.map(|t| -> Vec<f32> {
            d.read(t.moment1, t.floats).iter().map(|m| m * 10.0).collect()
        });
        assert!(geometry.iter().chain(&appearance).all(|g| *g == 0.0), "{name}");
        assert!(
            decoders[..SEMANTIC[0].weights]
                .iter()
                .chain(&decoders[HEAD_FLOATS..])
                .all(|g| *g == 0.0)
        );
        let fine = d.shape.surface[1][3] as usize * 16;
        let mut loss = |d: &mut Rig| ray_loss(d, &b);
        for (part, range) in [("coarse planes", 0..fine), ("fine planes", fine..semantic.len())] {
            let name = format!("{name}: {part}");
            check(&mut d, tensors[2].values, &semantic, range, &name, &mut loss);
        }
        for (part, range) in [
            ("layer 1", SEMANTIC[0].weight_range()),
            ("bias 1", SEMANTIC[0].bias_range()),
            ("layer 2", SEMANTIC[1].weight_range()),
            ("bias 2", SEMANTIC[1].bias_range()),
        ] {
            let name = format!("{name}: {part}");
            check(&mut d, tensors[3].values, &decoders, range, &name, &mut loss);
        }
    }
}

/// Without any cross-entropy at the rays the feature loss alone pulls the semantic planes to the
/// fused features; without its weight nothing moves, nor do other planes.
#[test]
fn the_feature_loss_moves_the_planes() {
    let train = |b: &Batch<'_>| {
        let mut d = supervised();
        let before = [d.geometry, d.appearance, d.semantic].map(|t| d.read(t.values, t.floats));
        let start = ray_loss(&mut d, &batch(0.0, 1.0));
        for _ in 0..30 {
            let mut r = Commands::new();
            d.record_forward(&mut r, b);
            d.record_backward(&mut r, b);
            d.record_step(&mut r, b, Rates { planes: 5e-3, decoders: 0.0 });
            d.submit(&r);
        }
        let after = [d.geometry, d.appearance, d.semantic].map(|t| d.read(t.values, t.floats));
        let moved =
            [0, 1, 2].map(|k| before[k].iter().zip(&after[k]).filter(|(a, b)| a != b).count());
        (start, ray_loss(&mut d, &batch(0.0, 1.0)), moved, after[2].len())
    };
    let (start, end, moved, all) = train(&batch(0.0, 0.6));
    println!("{start} {end} {moved:?} of {all}");
    assert!(end < 0.7 * start, "{start} {end}");
    assert_eq!(moved[..2], [0, 0]);
    assert!(moved[2] * 20 > all, "{moved:?} of {all}");
    let (start, end, moved, _) = train(&batch(0.0, 0.0));
    assert_eq!((start, moved), (end, [0, 0, 0]));
}

/// An image smaller than a token fuses nothing, and nothing fails.
#[test]
fn an_image_smaller_than_a_token() {
    let camera = mte_slam_types::camera::Camera { width: 30, height: 7, ..fixture::camera() };
    let c = config(FusionConfig::default());
    let mut d = Rig::new(Engine::cpu(), &c, camera, 0, fixture::shape());
    assert!(d.fusion.is_none() && d.suppressor.is_some());
    let mut r = Commands::new();
    d.upload_frame(&mut r, 0, &fixture::frame_of(&camera, 0));
    d.upload_pose(&mut r, 0, &fixture::pose(0));
    d.upload_window(&mut r, &[(0, true), (0, true), (0, true)]);
    d.record_fusion_step(&mut r, 0, 1e-3);
    let b = batch(0.1, 0.5);
    d.record_forward(&mut r, &b);
    d.record_backward(&mut r, &b);
    d.record_step(&mut r, &b, Rates { planes: 5e-3, decoders: 1e-3 });
    d.submit(&r);
    assert_eq!(d.read_status(), 0);
}

/// Each setting out of range is refused by name, with what was found and what is expected.
#[test]
fn bad_settings_are_refused_by_name() {
    type Change = fn(&mut Config);
    let bad: &[(&str, &str, Change)] = &[
        ("fusion.token_pixels", "7", |c| c.fusion.token_pixels = 7),
        ("fusion.token_pixels", "0", |c| c.fusion.token_pixels = 0),
        ("fusion.token_pixels", "40", |c| c.fusion.token_pixels = 40),
        ("fusion.key_stride", "0", |c| c.fusion.key_stride = 0),
        ("fusion.key_stride", "17", |c| c.fusion.key_stride = 17),
        ("fusion.local_kernel", "2", |c| c.fusion.local_kernel = 2),
        ("fusion.gate_kernel", "5", |c| c.fusion.gate_kernel = 5),
        ("fusion.steps", "1001", |c| c.fusion.steps = 1001),
        ("fusion.first_steps", "10001", |c| c.fusion.first_steps = 10_001),
        ("fusion.rate", "0", |c| c.fusion.rate = 0.0),
        ("fusion.rate", "NaN", |c| c.fusion.rate = f64::NAN),
        ("fusion.weight_class", "-1", |c| c.fusion.weight_class = -1.0),
        ("fusion.weight_color", "inf", |c| c.fusion.weight_color = f64::INFINITY),
        ("fusion.balance", "NaN", |c| c.fusion.balance = f64::NAN),
        ("fusion.weight", "-0.5", |c| c.fusion.weight = -0.5),
        ("suppressor.anchors", "0", |c| c.suppressor.anchors = 0),
        ("suppressor.anchors", "300", |c| c.suppressor.anchors = 300),
        ("suppressor.weight", "-1", |c| c.suppressor.weight = -1.0),
        ("suppressor.beta", "1.5", |c| c.suppressor.beta = 1.5),
        ("suppressor.beta", "NaN", |c| c.suppressor.beta = f64::NAN),
        ("suppressor.decay", "-0.1", |c| c.suppressor.decay = -0.1),
        ("suppressor.memory", "0", |c| c.suppressor.memory = 0.0),
        ("suppressor.spawn_distance", "0", |c| c.suppressor.spawn_distance = 0.0),
        ("suppressor.merge_distance", "NaN", |c| c.suppressor.merge_distance = f64::NAN),
        ("suppressor.stable", "-1", |c| c.suppressor.stable = -1.0),
        ("suppressor.min_importance", "-2", |c| c.suppressor.min_importance = -2.0),
    ];
    for (field, found, change) in bad {
        let mut c = Config::default();
        change(&mut c);
        let error = c.validate().expect_err(field);
        assert_eq!((error.path(), error.found()), (*field, Some(*found)));
        assert!(error.to_string().contains(field), "{error}");
    }
    // The edges of the ranges are good.
    let good: &[Change] = &[
        |c| c.suppressor.anchors = 1,
        |c| c.suppressor.anchors = 256,
        |c| c.fusion.token_pixels = 32,
        |c| c.fusion.key_stride = 16,
        |c| (c.fusion.steps, c.fusion.first_steps) = (0, 0),
        |c| (c.suppressor.beta, c.suppressor.decay) = (1.0, 1.0),
    ];
    for change in good {
        let mut c = Config::default();
        change(&mut c);
        c.validate().unwrap();
    }
}
