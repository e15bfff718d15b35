//! The per-sample class head, built as SNI-SLAM's: what deferred decoding is measured against.
//!
//! Samples go through the perceptron in parts of the batch, so that its activations fit a binding
//! whatever the batch; each part's gradients are added to the same rows of partial sums.
use super::{Device, Rates, Trained};
use crate::{
    engine::{Engine, EngineError},
    kernels::{
        adam::{self, AdamParams},
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
/// Samples a ray of a view: the first intervals that carry weight. Behind them next to no light
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

/// Buffers of the head.
pub struct SampleHead {
    /// Weights and biases of all layers.
    pub parameters: Trained,
    /// 32-256-256-256-C.
    pub layers: [SampleLayer; 4],
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
    step: u32,
}

impl SampleHead {
    /// `trained` is the most samples of a training batch, `rays` the most rays of any.
    pub(super) fn new(
        e: &mut Engine,
        classes: u32,
        trained: usize,
        rays: usize,
        seed: u32,
    ) -> Result<SampleHead, EngineError> {
        let mut weights = 0;
        let sizes = [INPUTS, HIDDEN, HIDDEN, HIDDEN, classes];
        let layers = core::array::from_fn(|i| {
            let layer = SampleLayer { inputs: sizes[i], outputs: sizes[i + 1], weights };
            weights = layer.bias() + layer.outputs;
            layer
        });
        let floats = weights as usize;
        let slots = trained.max(rays * VIEW_SLOTS as usize);
        let hidden = |e: &mut Engine, name| e.create_buffer(name, (PART * HIDDEN) as usize);
        let head = SampleHead {
            parameters: Trained::new(e, "sample head", floats)?,
            layers,
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
            partials: e.create_buffer("sample head partials", SPLITS as usize * floats)?,
            no_mask: e.create_buffer("no mask", 4)?,
            step: 0,
        };
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

impl Device {
    /// Classes (and, with labels, the loss) of the batch's rays.
    pub(super) fn record_sample_classes(&self, r: &mut Recording, p: &FieldParams) {
        self.record_sample_head(r, p, false);
    }

    /// Classes, loss and all gradients of the head and the semantic planes.
    pub(super) fn record_sample_backward(&self, r: &mut Recording, p: &FieldParams) {
        self.record_sample_head(r, p, true);
    }

    fn record_sample_head(&self, r: &mut Recording, p: &FieldParams, train: bool) {
        let Some(h) = &self.sample_head else { return };
        let views = p.flags & FLAG_DENSE != 0;
        let slots = if views { p.samples.min(VIEW_SLOTS) } else { p.samples };
        let p = FieldParams { slots, ..*p };
        r.dispatch_1d(
            &SAMPLE_FEATURES,
            &p,
            &[
                self.rays,
                self.depths,
                self.weights,
                self.semantic.values,
                h.features,
                h.slot_depths,
                h.slot_weights,
            ],
            (p.rays * slots) as usize,
        );
        let floats = h.parameters.floats;
        if train {
            r.clear(h.partials, 0, SPLITS as usize * floats);
        }
        let part = (PART / slots).max(1);
        for first_ray in (0..p.rays).step_by(part as usize) {
            let rays = part.min(p.rays - first_ray);
            self.record_part(r, h, &p, first_ray, rays, train);
        }
        if !train {
            return;
        }
        let columns = floats as u32;
        r.dispatch_1d(
            &REDUCE_PARTIALS,
            &ReducePartialsParams { rows: SPLITS, columns, row: columns, offset: 0 },
            &[h.partials, h.parameters.gradient],
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
                self.rays,
                h.slot_depths,
                h.slot_weights,
                h.feature_gradient,
                self.semantic.gradient,
                self.status,
            ],
            p.rays as usize * 24,
        );
    }

    fn record_part(
        &self,
        r: &mut Recording,
        h: &SampleHead,
        p: &FieldParams,
        first_ray: u32,
        rays: u32,
        train: bool,
    ) {
        let rows = rays * p.slots;
        let mut product = |m: MatrixProductParams, buffers: [BufferId; 4]| {
            r.dispatch(&MATRIX_PRODUCT, &m, &buffers, m.workgroups());
        };
        // Where the inputs of layer i lie, and from which float on.
        let at = first_ray * p.slots * INPUTS;
        let input = |i: usize| if i == 0 { (h.features, at) } else { (h.outputs[i - 1], 0) };
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
            product(layer, [from, h.parameters.values, h.no_mask, h.outputs[i]]);
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
            &[self.rays, h.slot_weights, self.class_weights, h.outputs[3], self.ray_out],
            [rays, 1, 1],
        );
        if !train {
            return;
        }
        let mut product = |m: MatrixProductParams, buffers: [BufferId; 4]| {
            r.dispatch(&MATRIX_PRODUCT, &m, &buffers, m.workgroups());
        };
        let mut delta = h.outputs[3];
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
            product(weights, [from, delta, h.no_mask, h.partials]);
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
                if i > 0 { (from, h.deltas[i % 2]) } else { (h.no_mask, h.feature_gradient) };
            product(inputs, [delta, h.parameters.values, mask, to]);
            delta = to;
        }
    }

    /// One step of the head's own Adam.
    pub(super) fn record_sample_step(&mut self, r: &mut Recording, rates: Rates) {
        let status = self.status;
        let Some(h) = &mut self.sample_head else { return };
        h.step += 1;
        let correction = |beta: f64| {
            let steps = h.step.min(1 << 20) as i32;
            (1.0 / (1.0 - num_traits::Float::powi(beta, steps))) as f32
        };
        let t = &h.parameters;
        adam::record(
            r,
            &AdamParams {
                offset: 0,
                count: t.floats as u32,
                fixed_point: 0,
                gradient_limit: 1 << 30,
                gradient_scale: 1.0,
                learning_rate: rates.decoders as f32,
                beta1: 0.9,
                beta2: 0.999,
                epsilon: 1e-15,
                correction1: correction(0.9),
                correction2: correction(0.999),
            },
            &[t.values, t.gradient, t.moment1, t.moment2, status],
        );
    }

    /// Classes at points: each is a ray of one sample that carries all weight.
    pub(super) async fn sample_classes(
        &mut self,
        points: &[[f32; 4]],
    ) -> Result<Vec<u32>, EngineError> {
        let mut classes = Vec::with_capacity(points.len());
        for chunk in points.chunks(self.max_rays as usize) {
            let mut rays = vec![0_u32; chunk.len() * RAY_WORDS];
            for (ray, p) in rays.chunks_exact_mut(RAY_WORDS).zip(chunk) {
                ray[..3].copy_from_slice(&[p[0], p[1], p[2]].map(f32::to_bits));
                ray[11] = 255;
            }
            let n = chunk.len();
            let weights: Vec<f32> = (0..2 * n).map(|i| ((i + 1) % 2) as f32).collect();
            let mut r = Recording::default();
            r.upload(self.rays, 0, &rays);
            r.clear(self.depths, 0, 2 * n);
            r.upload(self.weights, 0, &weights);
            let p = FieldParams { rays: n as u32, samples: 2, flags: 0, ..self.base };
            self.record_sample_classes(&mut r, &p);
            self.engine.submit(&r)?;
            let out: Vec<u32> = self.engine.read(self.ray_out, 0, n * RAY_OUT_FLOATS).await?;
            classes.extend(out.chunks_exact(RAY_OUT_FLOATS).map(|ray| ray[5]));
        }
        Ok(classes)
    }
}
