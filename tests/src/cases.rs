//! Inputs of every kernel, made by the twins of the kernels before it, so that a mistake of one
//! shader does not hide or excuse another's.
use crate::{
    Compare, TestRandom, anchors,
    case::{Case, SUMS},
    f32_words,
    fixture::{self, CLASSES, FRAMES, Options, POISON, State, words, workgroups},
    samples, tokens,
};
use mte_slam_core::{
    engine::Engine,
    kernel::Kernel,
    kernels::{
        adam::{ADAM, AdamParams},
        align_points::{ALIGN_POINTS, ALIGN_ROW},
        composite::COMPOSITE,
        composite_backward::COMPOSITE_BACKWARD,
        decode_rays::DECODE_RAYS,
        geometry_backward::GEOMETRY_BACKWARD,
        geometry_forward::GEOMETRY_FORWARD,
        geometry_weights::GEOMETRY_WEIGHTS,
        mask_rays::MASK_RAYS,
        pose_gradient::POSE_GRADIENT,
        pose_step::{POSE_STATE_FLOATS, POSE_STEP, PoseStepParams},
        query_points::QUERY_POINTS,
        reduce_partials::{REDUCE_PARTIALS, ReducePartialsParams},
        sample_depths::SAMPLE_DEPTHS,
        sample_rays::SAMPLE_RAYS,
        scatter_geometry::SCATTER_GEOMETRY,
        scatter_surface::SCATTER_SURFACE,
        shared::{FLAG_ANCHORS, FLAG_DENSE, FLAG_GUIDED, FLAG_MAP, FLAG_MASK, FLAG_POSE},
        weight_gradient::{WEIGHT_GRADIENT, WeightGradientParams},
    },
    layout::{
        ANCHOR_FLOATS, FEATURE, GEOMETRY_FLOATS, HEAD_FLOATS, RAY_OUT_FLOATS, RAY_STATE_FLOATS,
        STATE_ANCHOR, STATE_APPEARANCE, STATE_COLOR_DELTA, STATE_COLOR_HIDDEN,
        STATE_COLOR_HIDDEN_DELTA, STATE_FEATURE, STATE_FEATURE_DELTA, STATE_SEMANTIC,
        STATE_SEMANTIC_HIDDEN, STATE_SEMANTIC_HIDDEN_DELTA,
    },
    shaders::decoders::{COLOR, Layer, SEMANTIC},
};

fn tolerance(name: &str) -> Compare {
    let columns = |row, bits, relative| Compare::Columns { row, bits, relative };
    match name {
        // Frame and class of a ray are integers among floats.
        "rays" => columns(12, &[7, 11], 1e-6),
        // Class, and the mask.
        "ray_out" => columns(RAY_OUT_FLOATS, &[5, 11], SUMS),
        // Index of the nearest anchor.
        "ray_state" => columns(RAY_STATE_FLOATS, &[STATE_ANCHOR as usize * 4], SUMS),
        "features" => columns(32, &[], SUMS),
        "position_gradient" => columns(4, &[], SUMS),
        // WGSL grants sine and cosine little precision: 3e-6 off were seen in a browser.
        "poses" => columns(12, &[], 1e-5),
        // Sums over all samples of a batch.
        "partials" => columns(1, &[], 2.0 * SUMS),
        "depths" | "distances" | "weights" | "distance_gradient" | "logits_gradient" => {
            columns(1, &[], SUMS)
        }
        // A contribution rounds to another quantum now and then, and a sample at a cell's edge
        // may count to the neighbour; each adds one quantum to a sum of tens.
        "gradient_appearance" | "gradient_semantic" => Compare::I32 { quanta: 6 },
        _ => Compare::U32,
    }
}

fn case(
    name: &'static str,
    kernel: &'static Kernel,
    state: &State,
    overwritten: &[&'static str],
) -> Case {
    Case {
        name,
        kernel,
        params: words(&state.params),
        buffers: state.inputs(kernel),
        workgroups: workgroups(kernel, &state.params),
        tolerance: kernel
            .interface
            .bindings
            .iter()
            .map(|binding| tolerance(binding.name))
            .collect(),
        overwritten: overwritten.to_vec(),
    }
}

/// The state before a kernel of the usual chain.
fn before(kernel: &Kernel, o: &Options) -> State {
    let chain: [&'static Kernel; 11] = [
        &SAMPLE_RAYS,
        &SAMPLE_DEPTHS,
        &GEOMETRY_FORWARD,
        &COMPOSITE,
        &DECODE_RAYS,
        &MASK_RAYS,
        &COMPOSITE_BACKWARD,
        &GEOMETRY_BACKWARD,
        &POSE_GRADIENT,
        &SCATTER_GEOMETRY,
        &SCATTER_SURFACE,
    ];
    let mut state = State::new(o);
    let mut engine = Engine::cpu();
    for step in chain {
        if step.interface.name == kernel.interface.name {
            break;
        }
        if step.interface.name != MASK_RAYS.interface.name || o.flags & FLAG_MASK != 0 {
            state.run(&mut engine, step);
        }
    }
    state
}

/// A case of a kernel in the usual chain.
fn chained(
    name: &'static str,
    kernel: &'static Kernel,
    o: &Options,
    overwritten: &[&'static str],
) -> Case {
    case(name, kernel, &before(kernel, o), overwritten)
}

/// All cases of a kernel; empty for a name that is not known.
pub fn cases(kernel: &str) -> Vec<Case> {
    let usual = Options::default();
    let unguided = Options { flags: FLAG_MAP, ..usual };
    let classless = Options { classes: 0, ..usual };
    let light = Options { min_weight: 0.0, min_gradient: 0.0, ..usual };
    let tracking = Options { flags: FLAG_GUIDED | FLAG_POSE | FLAG_MASK, ..usual };
    match kernel {
        "adam" => adam(),
        "align_points" => align_points(),
        "sample_rays" => {
            let dense = Options { flags: FLAG_DENSE, ..usual };
            let both = Options { flags: FLAG_DENSE | FLAG_GUIDED, ..usual };
            let mut window = before(&SAMPLE_RAYS, &both);
            // Past the last pixel it starts again.
            window.params.first = window.params.width * window.params.height - 20;
            let mut rare = before(&SAMPLE_RAYS, &usual);
            (rare.params.rare_share, rare.params.rare_draws) = (0.6, 5);
            vec![
                chained("random", &SAMPLE_RAYS, &usual, &["rays"]),
                case("rare classes", &SAMPLE_RAYS, &rare, &["rays"]),
                chained("dense", &SAMPLE_RAYS, &dense, &["rays"]),
                case("dense and guided", &SAMPLE_RAYS, &window, &["rays"]),
            ]
        }
        "sample_depths" => {
            let dense = Options { flags: FLAG_DENSE, stratified: 40, ..usual };
            // The inverse of the cumulative weights divides by one interval's weight, at least
            // 1e-2 / 12 of the total where it matters: the error of a sum grows by that much.
            let importance = |mut case: Case| {
                case.tolerance[3] = Compare::Columns { row: 1, bits: &[], relative: 5e-4 };
                case
            };
            vec![
                chained("guided", &SAMPLE_DEPTHS, &usual, &["depths"]),
                importance(chained("unguided", &SAMPLE_DEPTHS, &unguided, &["depths"])),
                importance(chained("dense", &SAMPLE_DEPTHS, &dense, &["depths"])),
            ]
        }
        "geometry_forward" => {
            let render = Options { flags: FLAG_DENSE, ..usual };
            vec![
                chained("kept", &GEOMETRY_FORWARD, &usual, &["features", "distances"]),
                // Rendering keeps no features: the buffer stays as it was, bit for bit.
                {
                    let mut c = chained("render", &GEOMETRY_FORWARD, &render, &["distances"]);
                    c.tolerance[4] = Compare::U32;
                    c
                },
            ]
        }
        "composite" => vec![
            chained("cut off", &COMPOSITE, &usual, &["weights"]),
            chained("all intervals", &COMPOSITE, &light, &["weights"]),
            chained("unguided", &COMPOSITE, &unguided, &["weights"]),
            chained("no classes", &COMPOSITE, &classless, &["weights"]),
            chained("views", &COMPOSITE, &Options { flags: FLAG_DENSE, ..usual }, &["weights"]),
        ],
        "decode_rays" => vec![
            chained("classes", &DECODE_RAYS, &usual, &["ray_out", "logits_gradient"]),
            chained("no classes", &DECODE_RAYS, &classless, &["ray_out"]),
            supervised("anchors", 19, FLAG_GUIDED | FLAG_MAP, 0.3, 0.0, [0.0; 2]),
            supervised("fused features", 0, FLAG_GUIDED | FLAG_MAP, 0.0, 0.7, [0.0; 2]),
            supervised("both", 19, FLAG_GUIDED | FLAG_MAP, 0.3, 0.7, [0.0; 2]),
            supervised("doubted labels", 19, FLAG_GUIDED | FLAG_MAP, 0.0, 0.0, [20.0, 0.4]),
            supervised("classes of anchors", 19, FLAG_DENSE | FLAG_ANCHORS, 0.0, 0.0, [0.0; 2]),
        ],
        "mask_rays" => vec![
            case("tracking", &MASK_RAYS, &before(&MASK_RAYS, &tracking), &[]),
            many_outliers(&tracking),
            threshold(&tracking),
        ],
        "composite_backward" => vec![
            chained("poses", &COMPOSITE_BACKWARD, &usual, &["distance_gradient"]),
            chained("all intervals", &COMPOSITE_BACKWARD, &light, &["distance_gradient"]),
            chained("masked", &COMPOSITE_BACKWARD, &tracking, &["distance_gradient"]),
            chained("map only", &COMPOSITE_BACKWARD, &unguided, &["distance_gradient"]),
        ],
        "geometry_backward" => {
            let map = Options { flags: FLAG_GUIDED | FLAG_MAP, ..usual };
            vec![
                chained("both", &GEOMETRY_BACKWARD, &usual, &["position_gradient"]),
                {
                    let mut c = chained("map", &GEOMETRY_BACKWARD, &map, &[]);
                    c.tolerance[6] = Compare::U32;
                    c
                },
                {
                    let mut c =
                        chained("pose", &GEOMETRY_BACKWARD, &tracking, &["position_gradient"]);
                    c.tolerance[5] = Compare::U32;
                    c
                },
            ]
        }
        "pose_gradient" => vec![chained("usual", &POSE_GRADIENT, &usual, &[])],
        "scatter_geometry" => {
            let geometry = |name, o: &Options| {
                let mut c = chained(name, &SCATTER_GEOMETRY, o, &[]);
                c.tolerance[4] = Compare::I32 { quanta: 12 };
                c
            };
            let mut limited = geometry("saturated", &usual);
            let mut p = before(&SCATTER_GEOMETRY, &usual).params;
            p.contribution_limit = 100.0;
            limited.params = words(&p);
            vec![geometry("usual", &usual), geometry("all", &light), limited]
        }
        "scatter_surface" => vec![
            chained("usual", &SCATTER_SURFACE, &usual, &[]),
            chained("no classes", &SCATTER_SURFACE, &classless, &[]),
            chained("all intervals", &SCATTER_SURFACE, &light, &[]),
        ],
        "geometry_weights" => geometry_weights(&usual),
        "weight_gradient" => weight_gradient(&usual),
        "pose_step" => pose_steps(&usual),
        "query_points" => query_points(),
        "reduce_partials" => reduce_partials(),
        _ => samples::cases(kernel)
            .or_else(|| anchors::cases(kernel))
            .unwrap_or_else(|| tokens::cases(kernel)),
    }
}

/// `decode_rays` against anchors and fused features of the size of the rays' own features. Every
/// fourth slot of anchors is free, and every third token has no weight.
pub fn supervised(
    name: &'static str,
    anchors: u32,
    flags: u32,
    compression: f32,
    feature: f32,
    doubt: [f32; 2],
) -> Case {
    let mut state = before(&DECODE_RAYS, &Options { flags, ..Options::default() });
    let mut decoded = state.clone();
    decoded.run(&mut Engine::cpu(), &DECODE_RAYS);
    let own = decoded.floats("ray_state");
    let mut random = TestRandom(41);
    let mut near = |ray: usize| -> Vec<u32> {
        let at = ray * RAY_STATE_FLOATS + STATE_FEATURE as usize * 4;
        f32_words(own[at..at + FEATURE].iter().map(|x| x * random.uniform(0.5, 1.5)))
    };
    let mut words = Vec::new();
    for i in 0..anchors {
        words.extend(near(4 * i as usize));
        words.push(if i % 4 == 3 { 255 } else { i % CLASSES });
        words.resize(words.len() + ANCHOR_FLOATS - FEATURE - 1, 0);
    }
    words.resize(words.len().max(4), 0);
    state.buffers.insert("anchors", words);
    let p = &mut state.params;
    (p.anchors, p.weight_compression, p.weight_feature) = (anchors, compression, feature);
    [p.doubt_anchor, p.doubt_fused] = doubt;
    (p.token_size, p.token_columns, p.token_rows) = (8, p.width / 8, p.height / 8);
    let mut words = Vec::new();
    for token in 0..FRAMES * p.token_columns * p.token_rows {
        words.extend(near(4 * token as usize));
        words.push(if token % 3 == 2 { 0.0_f32 } else { 1.0 }.to_bits());
        // As large as logits of the features here: some labels are doubted, some are not.
        words.extend([2.0_f32.to_bits(), 0, 0]);
    }
    state.buffers.insert("targets", words);
    case(name, &DECODE_RAYS, &state, &["ray_out", "logits_gradient"])
}

fn with_errors(name: &'static str, o: &Options, error: impl Fn(usize) -> f32) -> Case {
    let mut state = before(&MASK_RAYS, o);
    let out = state.buffers.get_mut("ray_out").expect("a buffer of the fixture");
    for (i, ray) in out.chunks_exact_mut(RAY_OUT_FLOATS).enumerate() {
        ray[10] = error(i).to_bits();
    }
    case(name, &MASK_RAYS, &state, &[])
}

/// A third of the rays far off the others' depth error, some without.
fn many_outliers(o: &Options) -> Case {
    with_errors("outliers", o, |i| match i % 6 {
        0 => 0.0,
        1 | 2 => 0.3 + 0.03 * i as f32,
        _ => 0.001 + 0.0001 * i as f32,
    })
}

/// Half the rays at one error, the others in small steps around ten times that.
fn threshold(o: &Options) -> Case {
    with_errors("threshold", o, |i| if i <= 40 { 0.01 } else { 0.08 + 0.001 * (i - 40) as f32 })
}

fn geometry_weights(o: &Options) -> Vec<Case> {
    // Before geometry_backward: it needs the features.
    let mut state = before(&GEOMETRY_BACKWARD, o);
    let mut one = |name, stride: u32, iteration, groups: u32| {
        (state.params.decoder_stride, state.params.iteration) = (stride, iteration);
        state.buffers.insert("partials", vec![POISON; groups as usize * GEOMETRY_FLOATS]);
        let mut c = case(name, &GEOMETRY_WEIGHTS, &state, &["partials"]);
        c.workgroups = [groups, 1, 1];
        c
    };
    // 21 tiles: with 64 groups most rows are zero, with 4 each group has several tiles.
    vec![
        one("each tile", 1, 17, 64),
        one("few groups", 1, 17, 4),
        one("every fourth", 4, 17, 64),
        one("every fourth, another", 4, 18, 2),
    ]
}

/// The five layers of the per-ray decoders, as [`mte_slam_core::map::passes`] run them.
pub fn weight_layers(rays: u32, classes: u32, chunk: u32, row: u32) -> Vec<WeightGradientParams> {
    let head = Layer {
        inputs: FEATURE,
        outputs: classes as usize,
        weights: HEAD_FLOATS,
        bias: HEAD_FLOATS + FEATURE * classes as usize,
    };
    [
        (COLOR[0], STATE_APPEARANCE, STATE_COLOR_HIDDEN_DELTA),
        (COLOR[1], STATE_COLOR_HIDDEN, STATE_COLOR_DELTA),
        (SEMANTIC[0], STATE_SEMANTIC, STATE_SEMANTIC_HIDDEN_DELTA),
        (SEMANTIC[1], STATE_SEMANTIC_HIDDEN, STATE_FEATURE_DELTA),
        (head, STATE_FEATURE, 0),
    ]
    .iter()
    .enumerate()
    .map(|(i, (layer, x, d))| WeightGradientParams {
        rays,
        inputs: layer.inputs as u32,
        outputs: layer.outputs as u32,
        chunk,
        input_offset: x * 4,
        delta_offset: d * 4,
        from_logits: u32::from(i == 4),
        row,
        weight_offset: (layer.weights - GEOMETRY_FLOATS) as u32,
        bias_offset: (layer.bias - GEOMETRY_FLOATS) as u32,
        // The class head is stored output-major.
        input_stride: if i == 4 { 1 } else { layer.outputs as u32 },
        output_stride: if i == 4 { 16 } else { 1 },
    })
    .collect()
}

fn weight_gradient(o: &Options) -> Vec<Case> {
    let mut state = before(&COMPOSITE_BACKWARD, o);
    let (rays, chunk) = (state.params.rays, 30);
    let row = mte_slam_core::field::decoder_floats(CLASSES) - GEOMETRY_FLOATS;
    let chunks = rays.div_ceil(chunk);
    // Each layer writes its part only.
    state.buffers.insert("partials", vec![0; chunks as usize * row]);
    let names = ["colour 1", "colour 2", "semantic 1", "semantic 2", "class head"];
    let layers = weight_layers(rays, CLASSES, chunk, row as u32);
    names
        .into_iter()
        .zip(layers)
        .map(|(name, p)| {
            let mut c = case(name, &WEIGHT_GRADIENT, &state, &[]);
            c.params = words(&p);
            let jobs = chunks * (p.inputs + 1) * p.outputs.div_ceil(4);
            c.workgroups = [jobs.div_ceil(64), 1, 1];
            c
        })
        .collect()
}

fn pose_steps(o: &Options) -> Vec<Case> {
    // More rays than the workgroup's lanes.
    let o = Options { rays_per_frame: 70, ..*o };
    let mut state = before(&SCATTER_GEOMETRY, &o);
    let params = |restart| PoseStepParams {
        rays_per_frame: o.rays_per_frame,
        restart,
        learning_rate_translation: 2e-3,
        learning_rate_rotation: 1e-3,
        weight_color: 5.0,
        weight_depth: 1.0,
    };
    // A restart overwrites everything but the two unused words.
    let mut fresh = vec![POISON; FRAMES as usize * POSE_STATE_FLOATS];
    for slot in fresh.chunks_exact_mut(POSE_STATE_FLOATS) {
        slot[34..].fill(0);
    }
    state.buffers.insert("pose_state", fresh);
    let with = |name, state: &State, restart| {
        let mut c = case(name, &POSE_STEP, state, &[]);
        c.params = words(&params(restart));
        c.workgroups = [FRAMES, 1, 1];
        c.tolerance[4] = Compare::Columns { row: POSE_STATE_FLOATS, bits: &[], relative: 5e-5 };
        // A first step is the sign of the gradient times the rate.
        c.tolerance[3] = Compare::Columns { row: 12, bits: &[], relative: 2e-6 };
        c
    };
    let restart = with("restart", &state, 1);
    let mut engine = Engine::cpu();
    let after = fixture::run_words(
        &mut engine,
        restart.kernel,
        &restart.params,
        &restart.buffers,
        restart.workgroups,
    )
    .expect("a dispatch of the fixture");
    state.buffers.insert("pose_state", after[4].clone());
    state.buffers.insert("poses", after[3].clone());
    // The losses are the same again; rounding must not decide which is better.
    let mut best_loss = |loss: f32| {
        let kept = state.buffers.get_mut("pose_state").expect("a buffer of the fixture");
        kept.chunks_exact_mut(POSE_STATE_FLOATS).for_each(|s| s[12] = loss.to_bits());
        state.clone()
    };
    let going_on = with("better than the best", &best_loss(1e6), 0);
    let state = best_loss(1e-3);
    let worse = with("worse than the best", &state, 0);
    vec![restart, going_on, worse]
}

/// Points in, at and beyond the box.
fn points(count: usize) -> Vec<u32> {
    let mut random = TestRandom(51);
    f32_words((0..count * 4).map(|i| if i % 4 == 3 { 0.0 } else { random.uniform(-1.0, 1.0) }))
}

fn query_points() -> Vec<Case> {
    let mut state = State::new(&Options::default());
    state.params.rays = 150;
    state.buffers.insert("points", points(150));
    let mut query = |name, flags, classes, values: Vec<u32>, compare| {
        (state.params.flags, state.params.classes) = (flags, classes);
        state.buffers.insert("values", values);
        let overwritten: &[_] = if flags == 0 { &["values"] } else { &[] };
        let mut c = case(name, &QUERY_POINTS, &state, overwritten);
        c.tolerance[6] = compare;
        c
    };
    let line = Compare::Columns { row: 1, bits: &[], relative: SUMS };
    let surface = Compare::Columns { row: 8, bits: &[1], relative: SUMS };
    let mut cases = vec![
        query("distances", 0, CLASSES, vec![POISON; 150], line),
        query("surface", FLAG_MAP, CLASSES, vec![0; 150 * 8], surface),
        query("surface without classes", FLAG_MAP, 0, vec![0; 150 * 8], surface),
    ];
    // Anchors at what rays found, so that they are near features; every fourth slot is free.
    let mut supervised = supervised("", 19, FLAG_DENSE, 0.0, 0.0, [0.0; 2]);
    state.buffers.insert("anchors", supervised.buffers.swap_remove(5));
    (state.params.flags, state.params.classes) = (FLAG_MAP | FLAG_ANCHORS, CLASSES);
    state.params.anchors = 19;
    state.buffers.insert("values", vec![0; 150 * 8]);
    let mut anchors = case("classes of anchors", &QUERY_POINTS, &state, &[]);
    anchors.tolerance[6] = surface;
    cases.push(anchors);
    cases
}

/// Camera-frame points of the first frame (slot 0) with their intensity; some not in the map.
pub fn pixels(count: usize) -> Vec<[f32; 4]> {
    let (camera, frame) = (fixture::camera(), fixture::frame(0));
    let mut random = TestRandom(61);
    (0..count)
        .map(|_| {
            let i = random.bits() % camera.pixels() as u32;
            let z = f64::from(frame.depth[i as usize]) * fixture::DEPTH_UNIT_M;
            let p = camera.back_project(
                f64::from(i % camera.width),
                f64::from(i / camera.width),
                z * f64::from(random.uniform(0.6, 1.0)),
            );
            [p.x as f32, p.y as f32, p.z as f32, random.uniform(0.0, 1.0)]
        })
        .collect()
}

fn align_points() -> Vec<Case> {
    let mut state = State::new(&Options::default());
    let count = 200;
    state.params.rays = count;
    let pixels = pixels(count as usize);
    state.buffers.insert("pixels", f32_words(pixels.into_iter().flatten()));
    let rows = count.div_ceil(64) as usize;
    state.buffers.insert("partials", vec![POISON; rows * ALIGN_ROW]);
    let mut c = case("pixels", &ALIGN_POINTS, &state, &["partials"]);
    // Look-ups' gradients divide differences of neighbours by the cell.
    c.tolerance[5] = Compare::Columns { row: ALIGN_ROW, bits: &[], relative: 5e-5 };
    vec![c]
}

fn reduce_partials() -> Vec<Case> {
    let mut random = TestRandom(71);
    let p = ReducePartialsParams { rows: 7, columns: 100, row: 130, offset: 9 };
    let partials = f32_words((0..7 * 130).map(|_| random.uniform(-1.0, 1.0)));
    vec![Case {
        name: "part of a row",
        kernel: &REDUCE_PARTIALS,
        params: words(&p),
        buffers: vec![partials, f32_words([0.5; 120])],
        workgroups: [2, 1, 1],
        tolerance: vec![Compare::U32, Compare::Columns { row: 1, bits: &[], relative: 1e-6 }],
        overwritten: Vec::new(),
    }]
}

fn adam() -> Vec<Case> {
    let mut random = TestRandom(81);
    let mut floats = |n: usize, low, high| f32_words((0..n).map(|_| random.uniform(low, high)));
    let buffers = vec![
        floats(500, -1.0, 1.0),
        floats(500, -0.1, 0.1),
        floats(500, -0.1, 0.1),
        floats(500, 0.0, 0.01),
        vec![0; 4],
    ];
    let p = AdamParams {
        count: 500,
        gradient_limit: 1 << 30,
        gradient_scale: 1.0,
        learning_rate: 0.01,
        beta1: 0.9,
        beta2: 0.999,
        epsilon: 1e-15,
        correction1: 2.0,
        correction2: 3.0,
        ..AdamParams::default()
    };
    let column = Compare::Columns { row: 1, bits: &[], relative: 1e-5 };
    vec![Case {
        name: "float gradients",
        kernel: &ADAM,
        params: words(&p),
        buffers,
        workgroups: [1, 1, 1],
        tolerance: vec![column, Compare::U32, column, column, Compare::U32],
        overwritten: Vec::new(),
    }]
}
