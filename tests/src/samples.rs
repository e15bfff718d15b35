//! Cases of the kernels of the per-sample class head.
use crate::{
    Compare, TestRandom,
    case::{Case, SUMS},
    f32_words,
    fixture::{CLASSES, Options, POISON, State, words},
};
use mte_slam_core::{
    commands::workgroups_1d,
    engine::Engine,
    kernels::{
        composite::COMPOSITE,
        geometry_forward::GEOMETRY_FORWARD,
        matrix_product::{MATRIX_PRODUCT, MatrixProductParams, NO_SUMS},
        sample_depths::SAMPLE_DEPTHS,
        sample_features::SAMPLE_FEATURES,
        sample_logits::{SAMPLE_LOGITS, SampleLogitsParams},
        sample_rays::SAMPLE_RAYS,
        shared::FLAG_DENSE,
    },
    layout::RAY_OUT_FLOATS,
};

pub(crate) fn cases(kernel: &str) -> Option<Vec<Case>> {
    Some(match kernel {
        "matrix_product" => products(),
        "sample_features" => vec![
            features("every sample", &Options::default(), 16),
            features("views", &Options { flags: FLAG_DENSE, ..Options::default() }, 5),
        ],
        "sample_logits" => vec![
            logits("train", true, CLASSES, 16, 0),
            logits("part of a batch", true, CLASSES, 7, 30),
            logits("views", false, CLASSES, 7, 0),
            logits("many classes", true, 131, 5, 11),
        ],
        _ => return None,
    })
}

const fn columns(row: usize) -> Compare {
    Compare::Columns { row, bits: &[], relative: SUMS }
}

/// Layers forward, at inputs and at weights; sizes that fill no tile, offsets that are not 0.
fn products() -> Vec<Case> {
    let forward = MatrixProductParams {
        rows: 150,
        columns: 70,
        depth: 37,
        split: 37,
        left_offset: 5,
        left_row: 37,
        left_column: 1,
        right_offset: 3,
        right_row: 70,
        right_column: 1,
        product_row: 70,
        bias: 1,
        sums_offset: NO_SUMS,
        ..MatrixProductParams::default()
    };
    let rectified = MatrixProductParams { rectify: 1, product_offset: 11, ..forward };
    let inputs = MatrixProductParams {
        rows: 150,
        columns: 37,
        depth: 70,
        split: 70,
        left_offset: 2,
        left_row: 70,
        left_column: 1,
        right_offset: 3,
        right_row: 1,
        right_column: 70,
        product_row: 37,
        sums_offset: NO_SUMS,
        ..MatrixProductParams::default()
    };
    let masked = MatrixProductParams { masked: 1, mask_offset: 9, product_offset: 4, ..inputs };
    let weights = MatrixProductParams {
        rows: 70,
        columns: 133,
        depth: 150,
        split: 50,
        left_offset: 1,
        left_row: 1,
        left_column: 70,
        right_offset: 6,
        right_row: 133,
        right_column: 1,
        product_offset: 20,
        product_row: 133,
        split_offset: 20 + 70 * 133 + 133,
        accumulate: 1,
        sums_offset: 20 + 70 * 133,
        ..MatrixProductParams::default()
    };
    let narrow = MatrixProductParams { rows: 3, columns: 2, split: 150, ..weights };
    let all = [
        ("layer", forward),
        ("layer, rectified", rectified),
        ("inputs", inputs),
        ("inputs, masked", masked),
        ("weights", weights),
        ("few weights", narrow),
    ];
    let case = |(name, p): (&'static str, MatrixProductParams)| {
        let mut random = TestRandom(501);
        let mut floats = |n: usize| f32_words((0..n).map(|_| random.uniform(-1.0, 1.0)));
        let product = (3 * p.split_offset).max(p.product_offset + p.rows * p.product_row);
        let buffers = vec![floats(10_600), floats(20_000), floats(5_600), floats(product as usize)];
        Case {
            name,
            kernel: &MATRIX_PRODUCT,
            params: words(&p),
            buffers,
            workgroups: p.workgroups(),
            tolerance: vec![Compare::U32, Compare::U32, Compare::U32, columns(1)],
            overwritten: Vec::new(),
        }
    };
    all.into_iter().map(case).collect()
}

/// Rays with their samples' weights, and as many slots as asked for.
fn features(name: &'static str, o: &Options, slots: u32) -> Case {
    let mut state = State::new(o);
    let mut engine = Engine::cpu();
    for kernel in [&SAMPLE_RAYS, &SAMPLE_DEPTHS, &GEOMETRY_FORWARD, &COMPOSITE] {
        state.run(&mut engine, kernel);
    }
    state.params.slots = slots;
    let n = (state.params.rays * slots) as usize;
    state.buffers.insert("features", vec![POISON; n * 32]);
    state.buffers.insert("slot_depths", vec![POISON; n]);
    state.buffers.insert("slot_weights", vec![POISON; n]);
    let unchanged = Compare::U32;
    Case {
        name,
        kernel: &SAMPLE_FEATURES,
        params: words(&state.params),
        buffers: state.inputs(&SAMPLE_FEATURES),
        workgroups: workgroups_1d(n, SAMPLE_FEATURES.interface.workgroup_size),
        tolerance: [[unchanged; 4].as_slice(), &[columns(32), columns(1), columns(1)]].concat(),
        overwritten: vec!["features", "slot_depths", "slot_weights"],
    }
}

/// Random logits of a part of the fixture's rays; some rays are masked, some have no label.
fn logits(name: &'static str, train: bool, classes: u32, slots: u32, first_ray: u32) -> Case {
    let mut state = State::new(&Options::default());
    state.run(&mut Engine::cpu(), &SAMPLE_RAYS);
    let all = state.params.rays;
    let rays = 41.min(all - first_ray);
    let mut random = TestRandom(502);
    let mut floats = |n: u32, low, high| f32_words((0..n).map(|_| random.uniform(low, high)));
    let params = SampleLogitsParams {
        rays,
        first_ray,
        batch_rays: all,
        slots,
        classes,
        train: u32::from(train),
        weight_semantic: 0.7,
    };
    let buffers = vec![
        state.buffers["rays"].clone(),
        floats(all * slots, 0.0, 2.0 / slots as f32),
        // Weights above 0, adjustments of either sign.
        (0..classes).flat_map(|_| [floats(1, 0.5, 2.0)[0], floats(1, -1.0, 1.0)[0]]).collect(),
        floats(rays * slots * classes, -3.0, 3.0),
        vec![0; all as usize * RAY_OUT_FLOATS],
    ];
    let ray_out = Compare::Columns { row: RAY_OUT_FLOATS, bits: &[5, 11], relative: SUMS };
    Case {
        name,
        kernel: &SAMPLE_LOGITS,
        params: words(&params),
        buffers,
        workgroups: [rays, 1, 1],
        tolerance: vec![Compare::U32, Compare::U32, Compare::U32, columns(1), ray_out],
        overwritten: Vec::new(),
    }
}

/// The matrix product of a case in f64, by its definition; `None` where a product has splits.
pub fn expected_product(case: &Case) -> Option<Vec<f64>> {
    let p: MatrixProductParams = *bytemuck::from_bytes(bytemuck::cast_slice(&case.params));
    if p.split < p.depth {
        return None;
    }
    let at = |buffer: usize, i: u32| f64::from(f32::from_bits(case.buffers[buffer][i as usize]));
    let mut out: Vec<f64> = (0..case.buffers[3].len()).map(|i| at(3, i as u32)).collect();
    for row in 0..p.rows {
        for column in 0..p.columns {
            let right = |k| at(1, p.right_offset + k * p.right_row + column * p.right_column);
            let left = |k| at(0, p.left_offset + row * p.left_row + k * p.left_column);
            let mut v: f64 = (0..p.depth).map(|k| left(k) * right(k)).sum();
            v += if p.bias == 1 { right(p.depth) } else { 0.0 };
            v = if p.rectify == 1 { v.max(0.0) } else { v };
            let i = row * p.product_row + column;
            v = if p.masked == 1 && at(2, p.mask_offset + i) <= 0.0 { 0.0 } else { v };
            let cell = &mut out[(p.product_offset + i) as usize];
            *cell = v + if p.accumulate == 1 { *cell } else { 0.0 };
            if row == 0 && p.sums_offset != NO_SUMS {
                let total: f64 = (0..p.depth).map(right).sum();
                out[(p.sums_offset + column) as usize] += total;
            }
        }
    }
    Some(out)
}
