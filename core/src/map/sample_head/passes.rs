//! The passes of the per-sample class head.
use super::head::{INPUTS, PART, SPLITS, VIEW_SLOTS};
use crate::{
    call::Call,
    commands::Commands,
    engine::{Engine, EngineError},
    kernels::{
        matrix_product::{self, MatrixProductParams, NO_SUMS},
        reduce_partials::{self, ReducePartialsParams},
        sample_features,
        sample_logits::{self, SampleLogitsParams},
        scatter_geometry,
        shared::{FLAG_DENSE, RAY_WORDS},
    },
    layout::{FieldParams, RAY_OUT_FLOATS},
    map::{Map, Rates, Scratch, parameters::AdamStep},
};
use alloc::{vec, vec::Vec};
use core::ops::Range;

/// Classes (and, with labels, the loss) of the batch's rays.
pub(in crate::map) fn record_classes(
    r: &mut Commands,
    map: &Map,
    scratch: &Scratch,
    p: &FieldParams,
) {
    record_head(r, map, scratch, p, false);
}

/// Classes, loss and all gradients of the head and the semantic planes.
pub(in crate::map) fn record_backward(
    r: &mut Commands,
    map: &Map,
    scratch: &Scratch,
    p: &FieldParams,
) {
    record_head(r, map, scratch, p, true);
}

fn record_head(r: &mut Commands, map: &Map, scratch: &Scratch, p: &FieldParams, train: bool) {
    let (Some(h), Some(s)) = (&map.sample_head, &scratch.sample_head) else { return };
    let views = p.flags & FLAG_DENSE != 0;
    let slots = if views { p.samples.min(VIEW_SLOTS) } else { p.samples };
    let p = FieldParams { slots, ..*p };
    sample_features::Buffers {
        rays: scratch.rays,
        depths: scratch.depths,
        weights: scratch.weights,
        planes_semantic: map.semantic.values,
        features: s.features,
        slot_depths: s.slot_depths,
        slot_weights: s.slot_weights,
    }
    .record(r, &p, (p.rays * slots) as usize);
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
    reduce_partials::Buffers { partials: s.partials, gradient: h.parameters.gradient.cast() }
        .record(
            r,
            &ReducePartialsParams { rows: SPLITS, columns, row: columns, offset: 0 },
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
    scatter_geometry::Buffers {
        rays: scratch.rays,
        depths: s.slot_depths,
        distance_gradient: s.slot_weights,
        features: s.feature_gradient,
        gradient: map.semantic.gradient,
        status: map.status,
    }
    .record(r, &scatter, p.rays as usize * 24);
}

/// The part of the batch that the rays of a range are.
fn record_part(
    r: &mut Commands,
    map: &Map,
    scratch: &Scratch,
    p: &FieldParams,
    part: Range<u32>,
    train: bool,
) {
    let (Some(h), Some(s)) = (&map.sample_head, &scratch.sample_head) else { return };
    let (first_ray, rays) = (part.start, part.end - part.start);
    let rows = rays * p.slots;
    let mut product = |m: MatrixProductParams, buffers: matrix_product::Buffers| {
        buffers.record_workgroups(r, &m, m.workgroups());
    };
    // Where the inputs of layer i lie, and from which float on.
    let at = first_ray * p.slots * INPUTS;
    let input = |i: usize| if i == 0 { (s.features.floats(), at) } else { (s.outputs[i - 1], 0) };
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
        product(
            layer,
            matrix_product::Buffers {
                left: from,
                right: h.parameters.values.floats(),
                mask: s.no_mask,
                product: s.outputs[i],
            },
        );
    }
    sample_logits::Buffers {
        rays: scratch.rays,
        slot_weights: s.slot_weights,
        class_weights: map.class_weights,
        logits: s.outputs[3],
        ray_out: scratch.ray_out.cast(),
    }
    .record_workgroups(
        r,
        &SampleLogitsParams {
            rays,
            first_ray,
            batch_rays: p.rays,
            slots: p.slots,
            classes: p.classes,
            train: u32::from(train),
            weight_semantic: p.weight_semantic,
        },
        [rays, 1, 1],
    );
    if !train {
        return;
    }
    let mut product = |m: MatrixProductParams, buffers: matrix_product::Buffers| {
        buffers.record_workgroups(r, &m, m.workgroups());
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
        product(
            weights,
            matrix_product::Buffers {
                left: from,
                right: delta,
                mask: s.no_mask,
                product: s.partials,
            },
        );
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
            if i > 0 { (from, s.deltas[i % 2]) } else { (s.no_mask, s.feature_gradient.floats()) };
        product(
            inputs,
            matrix_product::Buffers {
                left: delta,
                right: h.parameters.values.floats(),
                mask,
                product: to,
            },
        );
        delta = to;
    }
}

/// The head's part of step `number` of the map.
pub(in crate::map) fn record_step(r: &mut Commands, map: &Map, rates: Rates, number: u32) {
    let Some(h) = &map.sample_head else { return };
    let floats = 0..h.parameters.floats;
    let step = AdamStep { floats, quanta: None, rate: rates.decoders, number };
    h.parameters.record_adam(r, map.status, step);
}

/// Classes at points: each is a ray of one sample that carries all weight.
pub(in crate::map) async fn classes_at(
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
        let mut r = Commands::default();
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
