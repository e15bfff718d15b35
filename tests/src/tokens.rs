//! Cases of the kernels on the token grid. Activations are random, so that every
//! column of a token's row differs, and grids have more columns than rows and no multiple of a
//! workgroup's tokens.
use crate::{
    Compare, TestRandom,
    case::{Case, SUMS},
    f32_words, fixture,
    fixture::{CLASSES, Options, POISON, State, words},
};
use mte_slam_core::{
    commands::workgroups_1d,
    engine::Engine,
    kernel::Kernel,
    kernels::{
        attend_keys::ATTEND_KEYS,
        attend_queries::ATTEND_QUERIES,
        attend_tokens::ATTEND_TOKENS,
        extract_tokens::EXTRACT_TOKENS,
        gate_backward::GATE_BACKWARD,
        gate_tokens::GATE_TOKENS,
        recall_tokens::RECALL_TOKENS,
        token_layer::TOKEN_LAYER,
        token_layer_backward::TOKEN_LAYER_BACKWARD,
        token_loss::TOKEN_LOSS,
        token_weights::TOKEN_WEIGHTS,
        tokens::{
            APPEARANCE_AT, COLOR_AT, DEPTHWISE_AT, FIRST_AT, FUSED_AT, GATE_AT, GEOMETRY_AT,
            GEOMETRY_INPUTS, GUIDED_AT, HIDDEN, HIDDEN_AT, LOCAL_AT, LOGITS_AT, NO_BIAS,
            NO_RESIDUAL, PATCH_INPUTS, RAW_GEOMETRY, RAW_HISTOGRAM, RAW_MEAN, RAW_PATCH, RAW_POINT,
            REFINED_AT, SECOND_AT, SEMANTIC_AT, STATISTICS_AT, TILE, TokenLayer, TokenParams,
        },
    },
    layout::TARGET_FLOATS,
};

/// Parameters of a grid, without a layer.
fn grid(columns: u32, rows: u32) -> TokenParams {
    let padded = CLASSES.next_multiple_of(4);
    TokenParams {
        columns,
        rows,
        stride: LOGITS_AT + padded,
        raw_stride: RAW_HISTOGRAM + padded,
        size: 8,
        classes: CLASSES,
        key_stride: 1,
        residual: NO_RESIDUAL,
        chunk: 13,
        ..TokenParams::default()
    }
}

/// 117 tokens: two workgroups, the second not full.
fn usual() -> TokenParams {
    grid(13, 9)
}

pub(crate) fn random(floats: usize, seed: u64, size: f32) -> Vec<u32> {
    let mut random = TestRandom(seed);
    f32_words((0..floats).map(|_| random.uniform(-size, size)))
}

fn tokens(p: &TokenParams, seed: u64) -> Vec<u32> {
    random(p.tokens() * p.stride as usize, seed, 1.0)
}

fn tolerance(p: &TokenParams, kernel: &Kernel) -> Vec<Compare> {
    let columns = |row: u32| Compare::Columns { row: row as usize, bits: &[], relative: SUMS };
    let one = |name| match name {
        "tokens" | "token_gradient" => columns(p.stride),
        "raw" => columns(p.raw_stride),
        "partials" => Compare::Columns { row: 1, bits: &[], relative: SUMS },
        // Copies, but for the largest logit.
        "targets" => Compare::Columns {
            row: TARGET_FLOATS,
            bits: &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16],
            relative: SUMS,
        },
        _ => Compare::U32,
    };
    kernel.interface.bindings.iter().map(|binding| one(binding.name)).collect()
}

fn token_case(
    name: &'static str,
    kernel: &'static Kernel,
    p: &TokenParams,
    buffers: Vec<Vec<u32>>,
    invocations: usize,
) -> Case {
    Case {
        name,
        kernel,
        params: words(p),
        buffers,
        workgroups: workgroups_1d(invocations, kernel.interface.workgroup_size),
        tolerance: tolerance(p, kernel),
        overwritten: Vec::new(),
    }
}

/// The buffers after a case, by the twin.
fn after(case: &Case) -> Vec<Vec<u32>> {
    let mut engine = Engine::cpu();
    fixture::run_words(&mut engine, case.kernel, &case.params, &case.buffers, case.workgroups)
        .expect("a dispatch of the fixture")
}

/// The two attentions of the fusion, with and without residual, and what only shows at another
/// grid: keys left out, one tile, several tiles, peaked weights.
fn attentions() -> Vec<(&'static str, TokenParams, Vec<u32>)> {
    let first =
        |p| TokenParams { query: FIRST_AT, output: GUIDED_AT, statistics: STATISTICS_AT, ..p };
    let second = |p, residual| TokenParams {
        query: SECOND_AT,
        output: REFINED_AT,
        statistics: STATISTICS_AT + 1,
        residual,
        ..p
    };
    let half = TokenParams { key_stride: 2, ..usual() };
    let usual = usual();
    let one_tile = grid(5, 3);
    let wide = TokenParams { key_stride: 3, ..grid(31, 7) };
    let mut peaked = tokens(&usual, 305);
    for row in peaked.chunks_exact_mut(usual.stride as usize) {
        for word in &mut row[FIRST_AT as usize..FIRST_AT as usize + 32] {
            *word = (f32::from_bits(*word) * 4.0).to_bits();
        }
    }
    vec![
        ("first", first(usual), tokens(&usual, 301)),
        ("residual", second(usual, APPEARANCE_AT), tokens(&usual, 302)),
        ("no residual", second(usual, NO_RESIDUAL), tokens(&usual, 303)),
        ("every other key", first(half), tokens(&usual, 304)),
        ("every other key and residual", second(half, APPEARANCE_AT), tokens(&usual, 305)),
        ("every third key", first(wide), tokens(&wide, 306)),
        ("one tile", second(one_tile, APPEARANCE_AT), tokens(&one_tile, 307)),
        ("peaked", first(usual), peaked),
    ]
}

fn groups(n: usize) -> usize {
    n.div_ceil(TILE) * TILE
}

fn attend_tokens() -> Vec<Case> {
    let mut cases: Vec<Case> = attentions()
        .into_iter()
        .map(|(name, p, tokens)| {
            token_case(name, &ATTEND_TOKENS, &p, vec![tokens], groups(p.tokens()))
        })
        .collect();
    // As large as a frame of 1024 x 640 pixels. Rows of this kernel's columns only.
    let p = TokenParams { stride: 68, query: 0, output: 48, statistics: 64, ..grid(128, 80) };
    cases.push(token_case(
        "a whole frame",
        &ATTEND_TOKENS,
        &p,
        vec![tokens(&p, 308)],
        groups(p.tokens()),
    ));
    cases
}

/// Tokens after the attention, and gradients of everything.
fn attended(p: &TokenParams, tokens: Vec<u32>) -> Vec<Vec<u32>> {
    let forward = token_case("", &ATTEND_TOKENS, p, vec![tokens], groups(p.tokens()));
    let mut buffers = after(&forward);
    buffers.push(random(buffers[0].len(), 311, 1.0));
    buffers
}

fn attend_queries() -> Vec<Case> {
    attentions()
        .into_iter()
        .map(|(name, p, tokens)| {
            let n = groups(p.tokens());
            token_case(name, &ATTEND_QUERIES, &p, attended(&p, tokens), n)
        })
        .collect()
}

fn attend_keys() -> Vec<Case> {
    attentions()
        .into_iter()
        .map(|(name, p, tokens)| {
            let queries =
                token_case("", &ATTEND_QUERIES, &p, attended(&p, tokens), groups(p.tokens()));
            token_case(name, &ATTEND_KEYS, &p, after(&queries), groups(p.keys()))
        })
        .collect()
}

fn raw(p: &TokenParams, seed: u64) -> Vec<u32> {
    let mut random = TestRandom(seed);
    let mut raw = Vec::new();
    for token in 0..p.tokens() {
        let row = raw.len();
        raw.extend((0..RAW_MEAN).map(|_| random.uniform(-1.0, 1.0)));
        raw.extend((RAW_MEAN..RAW_HISTOGRAM).map(|_| random.uniform(0.0, 1.0)));
        // Whether the token has geometry.
        raw[row + RAW_HISTOGRAM as usize - 1] =
            if random.bits().is_multiple_of(4) { 0.0 } else { 1.0 };
        raw.resize(row + p.raw_stride as usize, 0.0);
        // Every fourth token has no labels at all, others some of their pixels.
        if token % 4 != 3 {
            let at = row + RAW_HISTOGRAM as usize;
            raw[at + token % CLASSES as usize] = random.uniform(0.2, 0.7);
            raw[at + token * 7 % CLASSES as usize] += random.uniform(0.0, 0.3);
        }
    }
    f32_words(raw)
}

/// Layers of each kind: from raw inputs, linear, 3 x 3 (its outputs no multiple of 4), depthwise;
/// with bias and without, with rectifier and without.
fn layers() -> Vec<(&'static str, TokenLayer)> {
    let layer = |from_raw: u32, input: u32, inputs: u32, output: u32, outputs: u32| TokenLayer {
        from_raw,
        input,
        inputs,
        output,
        outputs,
        taps: 1,
        weights: 5,
        bias: NO_BIAS,
        input_stride: outputs,
        output_stride: 1,
        ..TokenLayer::default()
    };
    let bias = |l: TokenLayer| TokenLayer { bias: l.weights + l.weight_count() + 2, ..l };
    let rectified = |l| TokenLayer { activation: 1, ..l };
    let wide = |l| TokenLayer { taps: 3, ..l };
    let depthwise = |l| TokenLayer { depthwise: 1, taps: 3, ..l };
    let local = layer(0, GUIDED_AT, 16, DEPTHWISE_AT, 16);
    vec![
        ("raw", rectified(bias(layer(1, RAW_GEOMETRY, GEOMETRY_INPUTS, HIDDEN_AT, HIDDEN)))),
        ("histogram", layer(1, RAW_HISTOGRAM, CLASSES, SEMANTIC_AT, 16)),
        ("patch", bias(layer(1, RAW_PATCH, PATCH_INPUTS, APPEARANCE_AT, 16))),
        ("linear", bias(layer(0, HIDDEN_AT, HIDDEN, GEOMETRY_AT, 16))),
        ("linear without bias", layer(0, GEOMETRY_AT, 16, FIRST_AT, 16)),
        ("linear, rectified", rectified(bias(layer(0, DEPTHWISE_AT, 16, LOCAL_AT, 16)))),
        ("3 x 3", bias(wide(layer(0, GEOMETRY_AT, 48, GATE_AT, 3)))),
        ("3 x 3, rectified", rectified(wide(layer(0, DEPTHWISE_AT, 16, LOCAL_AT, 16)))),
        ("depthwise", rectified(bias(depthwise(local)))),
        ("depthwise without bias", depthwise(local)),
    ]
}

/// Layers of different sizes that one dispatch runs, with weights of their own.
fn side_by_side(names: &[&str]) -> Vec<TokenLayer> {
    let mut at = 3;
    let all = layers();
    names
        .iter()
        .map(|name| {
            let (_, mut l) = *all.iter().find(|(n, _)| n == name).expect("a layer's name");
            l.weights = at;
            at += l.weight_count() + 1;
            if l.bias != NO_BIAS {
                l.bias = at;
                at += l.outputs;
            }
            l
        })
        .collect()
}

/// A dispatch of some layers, which are neither the first nor the last ones of the table.
fn layer_case(
    name: &'static str,
    kernel: &'static Kernel,
    layers: &[TokenLayer],
    buffers: Vec<Vec<u32>>,
    p: TokenParams,
    jobs: impl Fn(&TokenLayer) -> usize,
) -> Case {
    let mut table = vec![TokenLayer { taps: 1, ..TokenLayer::default() }; 2];
    table.extend(layers);
    table.push(TokenLayer { outputs: 16, inputs: 16, taps: 1, ..TokenLayer::default() });
    let mut all = vec![table.iter().flat_map(words).collect()];
    all.extend(buffers);
    let most = layers.iter().map(jobs).max().unwrap_or(0);
    let mut case = token_case(name, kernel, &TokenParams { layer: 2, ..p }, all, most);
    case.workgroups[2] = layers.len() as u32;
    case
}

/// Raw inputs that start behind others.
fn raw_behind(p: TokenParams, seed: u64) -> (TokenParams, Vec<u32>) {
    let mut values = random(7, seed + 1, 1.0);
    values.extend(raw(&p, seed));
    (TokenParams { raw_at: 7, ..p }, values)
}

fn token_layer() -> Vec<Case> {
    let one = |name, layers: &[TokenLayer]| {
        let (p, raw) = raw_behind(usual(), 322);
        let buffers = vec![random(24_000, 321, 0.5), raw, tokens(&p, 323)];
        let jobs = |l: &TokenLayer| p.tokens() * l.quads();
        layer_case(name, &TOKEN_LAYER, layers, buffers, p, jobs)
    };
    let mut cases: Vec<Case> = layers().into_iter().map(|(name, l)| one(name, &[l])).collect();
    let several = side_by_side(&["raw", "patch", "histogram", "depthwise", "3 x 3"]);
    cases.push(one("side by side", &several));
    cases
}

fn token_layer_backward() -> Vec<Case> {
    let one = |name, layers: &[TokenLayer]| {
        let p = usual();
        let tokens = tokens(&p, 323);
        let gradient = random(tokens.len(), 324, 1.0);
        let buffers = vec![random(24_000, 321, 0.5), tokens, gradient];
        let jobs = |l: &TokenLayer| p.tokens() * l.inputs as usize;
        layer_case(name, &TOKEN_LAYER_BACKWARD, layers, buffers, p, jobs)
    };
    let inner = layers().into_iter().filter(|(_, l)| l.from_raw == 0);
    let mut cases: Vec<Case> = inner.map(|(name, l)| one(name, &[l])).collect();
    // Neither adds to what the other one reads.
    let several = side_by_side(&["linear", "depthwise"]);
    cases.push(one("side by side", &several));
    cases
}

fn token_weights() -> Vec<Case> {
    let plain = TokenLayer { input: FUSED_AT, inputs: 16, taps: 1, ..TokenLayer::default() };
    // The class head's weights are stored output-major.
    let head = TokenLayer {
        output: LOGITS_AT,
        outputs: CLASSES,
        bias: CLASSES * 16,
        input_stride: 1,
        output_stride: 16,
        ..plain
    };
    // Rows with room for a fourth output that there is not.
    let color = TokenLayer {
        output: COLOR_AT,
        outputs: 3,
        bias: 64,
        input_stride: 4,
        output_stride: 1,
        ..plain
    };
    let one = |name, chunk, layers: &[TokenLayer]| {
        let (p, raw) = raw_behind(TokenParams { row: 24_000, chunk, ..usual() }, 333);
        let tokens = tokens(&p, 331);
        let gradient = random(tokens.len(), 332, 1.0);
        let chunks = p.tokens().div_ceil(chunk as usize);
        // Each layer writes its part only.
        let partials = vec![0; chunks * p.row as usize];
        let buffers = vec![raw, tokens, gradient, partials];
        let jobs = |l: &TokenLayer| l.weight_jobs() * chunks;
        layer_case(name, &TOKEN_WEIGHTS, layers, buffers, p, jobs)
    };
    let mut cases: Vec<Case> = layers().into_iter().map(|(name, l)| one(name, 13, &[l])).collect();
    cases.push(one("class head", 13, &[head]));
    cases.push(one("colour head", 40, &[color]));
    let several = side_by_side(&["raw", "patch", "histogram", "linear", "depthwise", "3 x 3"]);
    cases.push(one("side by side", 13, &several));
    cases
}

fn gate(p: &TokenParams) -> Case {
    let mut tokens = tokens(p, 341);
    // Gates from closed to open.
    for (i, row) in tokens.chunks_exact_mut(p.stride as usize).enumerate() {
        let gate = &mut row[GATE_AT as usize..GATE_AT as usize + 3];
        gate.rotate_left(i % 3);
        gate[0] = (f32::from_bits(gate[0]) * 6.0).to_bits();
    }
    token_case("gates", &GATE_TOKENS, p, vec![tokens], p.tokens())
}

fn gate_backward() -> Vec<Case> {
    let one = |name, p: TokenParams| {
        let mut buffers = after(&gate(&p));
        buffers.push(random(buffers[0].len(), 342, 1.0));
        token_case(name, &GATE_BACKWARD, &p, buffers, p.tokens())
    };
    vec![one("gates", usual()), one("few tokens", grid(5, 2))]
}

fn token_loss() -> Vec<Case> {
    let one = |name, train, unlabelled, p: TokenParams| {
        let p = TokenParams {
            train,
            slot: 1,
            weight_class: 0.7,
            weight_color: 0.4,
            color_head: 9,
            ..p
        };
        let tokens = tokens(&p, 351);
        let mut raw = raw(&p, 352);
        if unlabelled {
            for row in raw.chunks_exact_mut(p.raw_stride as usize) {
                row[RAW_HISTOGRAM as usize..].fill(0);
            }
        }
        let gradient = random(tokens.len(), 353, 0.1);
        let buffers = vec![
            random(100, 354, 0.5),
            f32_words(fixture::decoders(CLASSES)),
            f32_words([0.5, 1.0, 2.0, 0.25, 1.5]),
            raw,
            tokens,
            gradient,
            vec![0; 3 * p.tokens() * TARGET_FLOATS],
        ];
        token_case(name, &TOKEN_LOSS, &p, buffers, p.tokens())
    };
    vec![
        one("train", 1, false, usual()),
        one("targets only", 0, false, usual()),
        one("no labels", 1, true, usual()),
        one("few tokens", 1, false, grid(4, 2)),
    ]
}

/// Slots of images with smooth depth, holes in depth, and labels of which some are no class.
fn extract_tokens() -> Vec<Case> {
    let one = |name, width: u32, height: u32, size: u32, depth: &dyn Fn(u32, u32) -> u32| {
        let slots = 3;
        let mut random = TestRandom(361);
        let (mut colors, mut depths) = (Vec::new(), Vec::new());
        for _ in 0..slots {
            let mut image = Vec::new();
            for pixel in 0..width * height {
                let (u, v) = (pixel % width, pixel / width);
                let label = match random.bits() % 8 {
                    0 => 255,
                    1 => CLASSES + 1,
                    _ => (u / 5 + v / 7) % CLASSES,
                };
                colors.push(random.bits() & 0xff_ffff | label << 24);
                let hole = random.bits().is_multiple_of(3);
                image.push(if hole { 0 } else { depth(u, v) });
            }
            depths
                .extend(image.chunks(2).map(|d| d[0] | d.get(1).map_or(0, |second| second << 16)));
        }
        let poses = (0..slots).flat_map(|i| mte_slam_core::map::pose_words(&fixture::pose(i)));
        let p = TokenParams {
            width,
            height,
            size,
            slot: 1,
            fx: 17.0,
            fy: 18.0,
            cx: 11.7,
            cy: 9.2,
            box_min: [-2.0, -1.5, -1.0, 0.0],
            depth_unit: 0.001,
            ..grid(width / size, height / size)
        };
        let raw = vec![POISON; p.tokens() * p.raw_stride as usize];
        let buffers = vec![f32_words(poses), colors, depths, raw];
        let mut case = token_case(name, &EXTRACT_TOKENS, &p, buffers, p.tokens());
        case.overwritten = vec!["raw"];
        case
    };
    let slope = |u: u32, v: u32| 900 + 13 * u + 7 * v;
    vec![
        one("small image", 25, 19, 8, &slope),
        one("odd image", 75, 67, 8, &slope),
        one("tokens of 16", 75, 67, 16, &slope),
        one("half an image", 75, 67, 8, &|u, v| if u > 40 { 0 } else { slope(u, v) }),
    ]
}

/// Points in, at and beyond the map's box; every fourth token has none.
fn recall_tokens() -> Vec<Case> {
    let mut state = State::new(&Options::default());
    let grid = usual();
    let p = &mut state.params;
    (p.token_columns, p.token_rows, p.raw_stride) = (grid.columns, grid.rows, grid.raw_stride);
    let (mut random, mut raw) = (TestRandom(395), raw(&grid, 396));
    for row in raw.chunks_exact_mut(grid.raw_stride as usize) {
        let at = RAW_POINT as usize;
        row[at..at + 3].fill_with(|| random.uniform(-1.0, 1.0).to_bits());
    }
    let buffers =
        vec![state.buffers["planes_semantic"].clone(), state.buffers["decoders"].clone(), raw];
    let mut case = token_case("points", &RECALL_TOKENS, &grid, buffers, grid.tokens());
    case.params = words(&state.params);
    vec![case]
}

/// All cases of a kernel; empty for a name that is not known.
pub(crate) fn cases(kernel: &str) -> Vec<Case> {
    match kernel {
        "attend_keys" => attend_keys(),
        "attend_queries" => attend_queries(),
        "attend_tokens" => attend_tokens(),
        "extract_tokens" => extract_tokens(),
        "gate_backward" => gate_backward(),
        "gate_tokens" => vec![gate(&usual()), gate(&grid(5, 2))],
        "recall_tokens" => recall_tokens(),
        "token_layer" => token_layer(),
        "token_layer_backward" => token_layer_backward(),
        "token_loss" => token_loss(),
        "token_weights" => token_weights(),
        _ => Vec::new(),
    }
}
