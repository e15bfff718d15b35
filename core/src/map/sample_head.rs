//! The per-sample class head, built as SNI-SLAM's: what deferred decoding is measured against.
//!
//! Samples go through the perceptron in parts of the batch, so that its activations fit a binding
//! whatever the batch; each part's gradients are added to the same rows of partial sums.
use super::{Map, ParameterTensor, Rates, Scratch, parameters::AdamStep};
use crate::{
    engine::{Engine, EngineError},
    kernels::{
        matrix_product::{MATRIX_PRODUCT, MatrixProductParams, NO_SUMS},
        reduce_partials::{REDUCE_PARTIALS, ReducePartialsParams},
        sample_features::SAMPLE_FEATURES,
        sample_logits::{SAMPLE_LOGITS, SampleLogitsParams},
        scatter_geometry::SCATTER_GEOMETRY,
        shared::{FLAG_DENSE, RAY_WORDS, random_f32},
    },
    layout::{CHANNELS, FieldParams, RAY_OUT_FLOATS},
    recording::{BufferId, Recording},
};
use alloc::{vec, vec::Vec};
use core::ops::Range;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Units of each hidden layer.
const HIDDEN: u32 = 256;
/// Inputs: the semantic features of a sample, coarse and fine.
const INPUTS: u32 = 2 * CHANNELS as u32;
/// Samples that go through the perceptron at once.
const PART: u32 = 8192;
/// Rows of partial sums of the weights' gradients.
const SPLITS: u32 = 4;
/// Samples per ray of a view: the first intervals that carry weight. Behind them next to no light
/// is left; on the others the head would run for nothing.
const VIEW_SLOTS: u32 = 24;

/// A layer: weights input-major, then biases.
#[derive(Clone, Copy, Debug)]
pub struct SampleLayer {
    /// Inputs.
    pub inputs: u32,
    /// Outputs.
    pub outputs: u32,
    /// First weight in the parameters.
    pub weights: u32,
}

impl SampleLayer {
    /// First bias in the parameters.
    pub fn bias(&self) -> u32 {
        self.weights + self.inputs * self.outputs
    }
}

/// The parameters of the head.
pub struct SampleHead {
    /// Weights and biases of all layers.
    pub parameters: ParameterTensor,
    /// 32-256-256-256-C.
    pub layers: [SampleLayer; 4],
}

/// Activations and gradients of the head.
pub struct SampleScratch {
    features: BufferId,
    feature_gradient: BufferId,
    slot_depths: BufferId,
    slot_weights: BufferId,
    /// Outputs of the layers for a part's samples; the last are the logits, then their gradients.
    outputs: [BufferId; 4],
    /// Gradients at hidden layers, taking turns.
    deltas: [BufferId; 2],
    partials: BufferId,
    no_mask: BufferId,
}

impl SampleHead {
    pub(super) fn new(e: &mut Engine, classes: u32, seed: u32) -> Result<SampleHead, EngineError> {
        let mut weights = 0;
        let sizes = [INPUTS, HIDDEN, HIDDEN, HIDDEN, classes];
        let layers = core::array::from_fn(|i| {
            let layer = SampleLayer { inputs: sizes[i], outputs: sizes[i + 1], weights };
            weights = layer.bias() + layer.outputs;
            layer
        });
        let floats = weights as usize;
        let parameters = ParameterTensor::new(e, "sample head", floats)?;
        let head = SampleHead { parameters, layers };
        let mut w = vec![0.0_f32; floats];
        for layer in &head.layers {
            let limit = (6.0 / layer.inputs as f32).sqrt();
            for i in layer.weights..layer.bias() {
                w[i as usize] = (2.0 * random_f32(seed, 0x1721, i, 11) - 1.0) * limit;
            }
        }
        let mut r = Recording::default();
        r.upload(head.parameters.values, 0, &w);
        e.submit(&r)?;
        Ok(head)
    }
}

impl SampleScratch {
    /// `trained` is the most samples of a training batch, `rays` the most rays of any.
    pub(super) fn new(
        e: &mut Engine,
        head: &SampleHead,
        classes: u32,
        trained: usize,
        rays: usize,
    ) -> Result<SampleScratch, EngineError> {
        let slots = trained.max(rays * VIEW_SLOTS as usize);
        let hidden = |e: &mut Engine, name| e.create_buffer(name, (PART * HIDDEN) as usize);
        let partials = SPLITS as usize * head.parameters.floats;
        Ok(SampleScratch {
            features: e.create_buffer("sample features", slots * INPUTS as usize)?,
            feature_gradient: e
                .create_buffer("sample feature gradients", trained * INPUTS as usize)?,
            slot_depths: e.create_buffer("slot depths", slots)?,
            slot_weights: e.create_buffer("slot weights", slots)?,
            outputs: [
                hidden(e, "sample layer 1")?,
                hidden(e, "sample layer 2")?,
                hidden(e, "sample layer 3")?,
                e.create_buffer("sample logits", (PART * classes) as usize)?,
            ],
            deltas: [hidden(e, "sample deltas 1")?, hidden(e, "sample deltas 2")?],
            partials: e.create_buffer("sample head partials", partials)?,
            no_mask: e.create_buffer("no mask", 4)?,
        })
    }
}

/// Classes (and, with labels, the loss) of the batch's rays.
pub(super) fn record_classes(r: &mut Recording, map: &Map, scratch: &Scratch, p: &FieldParams) {
    record_head(r, map, scratch, p, false);
}

/// Classes, loss and all gradients of the head and the semantic planes.
pub(super) fn record_backward(r: &mut Recording, map: &Map, scratch: &Scratch, p: &FieldParams) {
    record_head(r, map, scratch, p, true);
}

fn record_head(r: &mut Recording, map: &Map, scratch: &Scratch, p: &FieldParams, train: bool) {
    let (Some(h), Some(s)) = (&map.sample_head, &scratch.sample_head) else { return };
    let views = p.flags & FLAG_DENSE != 0;
    let slots = if views { p.samples.min(VIEW_SLOTS) } else { p.samples };
    let p = FieldParams { slots, ..*p };
    r.dispatch_1d(
        &SAMPLE_FEATURES,
        &p,
        &[
            scratch.rays,
            scratch.depths,
            scratch.weights,
            map.semantic.values,
            s.features,
            s.slot_depths,
            s.slot_weights,
        ],
        (p.rays * slots) as usize,
    );
    let floats = h.parameters.floats;
    if train {
        r.clear(s.partials, 0, SPLITS as usize * floats);
    }
    let part = (PART / slots).max(1);
    for first_ray in (0..p.rays).step_by(part as usize) {
        let rays = part.min(p.rays - first_ray);
        record_part(r, map, scratch, &p, first_ray..first_ray + rays, train);
    }
    if !train {
        return;
    }
    let columns = floats as u32;
    r.dispatch_1d(
        &REDUCE_PARTIALS,
        &ReducePartialsParams { rows: SPLITS, columns, row: columns, offset: 0 },
        &[s.partials, h.parameters.gradient],
        floats,
    );
    // The kernel scatters gradients of samples into any planes whose grids it is given; a slot
    // without weight is skipped as a sample without gradient.
    let scatter = FieldParams {
        geometry_coarse: p.surface_coarse,
        geometry_fine: p.surface_fine,
        geometry_inv_cell: p.surface_inv_cell,
        scale_geometry: p.scale_semantic,
        samples: slots,
        ..p
    };
    r.dispatch_1d(
        &SCATTER_GEOMETRY,
        &scatter,
        &[
            scratch.rays,
            s.slot_depths,
            s.slot_weights,
            s.feature_gradient,
            map.semantic.gradient,
            map.status,
        ],
        p.rays as usize * 24,
    );
}

/// The part of the batch that the rays of a range are.
fn record_part(
    r: &mut Recording,
    map: &Map,
    scratch: &Scratch,
    p: &FieldParams,
    part: Range<u32>,
    train: bool,
) {
    let (Some(h), Some(s)) = (&map.sample_head, &scratch.sample_head) else { return };
    let (first_ray, rays) = (part.start, part.end - part.start);
    let rows = rays * p.slots;
    let mut product = |m: MatrixProductParams, buffers: [BufferId; 4]| {
        r.dispatch(&MATRIX_PRODUCT, &m, &buffers, m.workgroups());
    };
    // Where the inputs of layer i lie, and from which float on.
    let at = first_ray * p.slots * INPUTS;
    let input = |i: usize| if i == 0 { (s.features, at) } else { (s.outputs[i - 1], 0) };
    for (i, layer) in h.layers.iter().enumerate() {
        let (from, left_offset) = input(i);
        let layer = MatrixProductParams {
            rows,
            columns: layer.outputs,
            depth: layer.inputs,
            split: layer.inputs,
            left_offset,
            left_row: layer.inputs,
            left_column: 1,
            right_offset: layer.weights,
            right_row: layer.outputs,
            right_column: 1,
            product_row: layer.outputs,
            bias: 1,
            rectify: u32::from(i < 3),
            sums_offset: NO_SUMS,
            ..MatrixProductParams::default()
        };
        product(layer, [from, h.parameters.values, s.no_mask, s.outputs[i]]);
    }
    r.dispatch(
        &SAMPLE_LOGITS,
        &SampleLogitsParams {
            rays,
            first_ray,
            batch_rays: p.rays,
            slots: p.slots,
            classes: p.classes,
            train: u32::from(train),
            weight_semantic: p.weight_semantic,
        },
        &[scratch.rays, s.slot_weights, map.class_weights, s.outputs[3], scratch.ray_out],
        [rays, 1, 1],
    );
    if !train {
        return;
    }
    let mut product = |m: MatrixProductParams, buffers: [BufferId; 4]| {
        r.dispatch(&MATRIX_PRODUCT, &m, &buffers, m.workgroups());
    };
    let mut delta = s.outputs[3];
    for (i, layer) in h.layers.iter().enumerate().rev() {
        let (from, offset) = input(i);
        let weights = MatrixProductParams {
            rows: layer.inputs,
            columns: layer.outputs,
            depth: rows,
            split: rows.div_ceil(SPLITS),
            left_offset: offset,
            left_row: 1,
            left_column: layer.inputs,
            right_row: layer.outputs,
            right_column: 1,
            product_offset: layer.weights,
            product_row: layer.outputs,
            split_offset: h.parameters.floats as u32,
            accumulate: 1,
            sums_offset: layer.bias(),
            ..MatrixProductParams::default()
        };
        product(weights, [from, delta, s.no_mask, s.partials]);
        let inputs = MatrixProductParams {
            rows,
            columns: layer.inputs,
            depth: layer.outputs,
            split: layer.outputs,
            left_row: layer.outputs,
            left_column: 1,
            right_offset: layer.weights,
            right_row: 1,
            right_column: layer.outputs,
            product_offset: offset,
            product_row: layer.inputs,
            masked: u32::from(i > 0),
            sums_offset: NO_SUMS,
            ..MatrixProductParams::default()
        };
        let (mask, to) =
            if i > 0 { (from, s.deltas[i % 2]) } else { (s.no_mask, s.feature_gradient) };
        product(inputs, [delta, h.parameters.values, mask, to]);
        delta = to;
    }
}

/// The head's part of step `number` of the map.
pub(super) fn record_step(r: &mut Recording, map: &Map, rates: Rates, number: u32) {
    let Some(h) = &map.sample_head else { return };
    let floats = 0..h.parameters.floats;
    let step = AdamStep { floats, quanta: None, rate: rates.decoders, number };
    h.parameters.record_adam(r, map.status, step);
}

/// Classes at points: each is a ray of one sample that carries all weight.
pub(super) async fn classes_at(
    engine: &mut Engine,
    map: &Map,
    scratch: &Scratch,
    points: &[[f32; 4]],
) -> Result<Vec<u32>, EngineError> {
    let mut classes = Vec::with_capacity(points.len());
    for chunk in points.chunks(scratch.max_rays as usize) {
        let mut rays = vec![0_u32; chunk.len() * RAY_WORDS];
        for (ray, p) in rays.chunks_exact_mut(RAY_WORDS).zip(chunk) {
            ray[..3].copy_from_slice(&[p[0], p[1], p[2]].map(f32::to_bits));
            ray[11] = 255;
        }
        let n = chunk.len();
        let weights: Vec<f32> = (0..2 * n).map(|i| ((i + 1) % 2) as f32).collect();
        let mut r = Recording::default();
        r.upload(scratch.rays, 0, &rays);
        r.clear(scratch.depths, 0, 2 * n);
        r.upload(scratch.weights, 0, &weights);
        let p = FieldParams { rays: n as u32, samples: 2, flags: 0, ..map.base };
        record_classes(&mut r, map, scratch, &p);
        engine.submit(&r)?;
        let out: Vec<u32> = engine.read(scratch.ray_out, 0, n * RAY_OUT_FLOATS).await?;
        classes.extend(out.chunks_exact(RAY_OUT_FLOATS).map(|ray| ray[5]));
    }
    Ok(classes)
}
