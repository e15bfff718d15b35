//! The recordings of one pass over a batch of rays: forward, backward, optimisation steps.
use super::{Batch, DECODER_CHUNK, Device, GEOMETRY_ROWS, QUANTA, Rates, Trained};
use crate::{
    kernels::{
        adam::{self, AdamParams},
        composite::COMPOSITE,
        composite_backward::COMPOSITE_BACKWARD,
        decode_rays::DECODE_RAYS,
        geometry_backward::GEOMETRY_BACKWARD,
        geometry_forward::GEOMETRY_FORWARD,
        geometry_weights::GEOMETRY_WEIGHTS,
        mask_rays::MASK_RAYS,
        pose_gradient::POSE_GRADIENT,
        pose_step::{POSE_STEP, PoseStepParams},
        reduce_partials::{REDUCE_PARTIALS, ReducePartialsParams},
        sample_depths::SAMPLE_DEPTHS,
        sample_rays::SAMPLE_RAYS,
        scatter_geometry::SCATTER_GEOMETRY,
        scatter_surface::SCATTER_SURFACE,
        shared::{FLAG_ANCHORS, FLAG_MAP, FLAG_MASK, FLAG_POSE},
        weight_gradient::{WEIGHT_GRADIENT, WeightGradientParams},
    },
    layout::{
        BACKWARD_STRIP, FieldParams, GEOMETRY_FLOATS, STATE_APPEARANCE, STATE_COLOR_DELTA,
        STATE_COLOR_HIDDEN, STATE_COLOR_HIDDEN_DELTA, STATE_FEATURE, STATE_FEATURE_DELTA,
        STATE_SEMANTIC, STATE_SEMANTIC_HIDDEN, STATE_SEMANTIC_HIDDEN_DELTA,
    },
    recording::Recording,
};
use alloc::vec;

impl Device {
    fn params(&self, b: &Batch<'_>) -> FieldParams {
        let mut p = self.base;
        p.rays = b.rays();
        p.rays_per_frame = b.rays_per_frame;
        p.samples = b.samples();
        p.stratified = b.stratified;
        p.surface_samples = b.surface;
        p.flags = b.flags;
        p.iteration = b.iteration;
        p.first = b.first;
        p.rare_share = b.rare_share as f32;
        p.weight_free = b.loss.free_space as f32;
        p.weight_centre = b.loss.centre as f32;
        p.weight_tail = b.loss.tail as f32;
        p.weight_depth = b.loss.depth as f32;
        p.weight_color = b.loss.color as f32;
        p.weight_semantic = b.loss.semantic as f32;
        let g = &b.guidance;
        p.weight_compression = g.compression as f32;
        p.weight_feature = g.feature as f32;
        p.doubt_anchor = g.doubt_anchor as f32;
        p.doubt_fused = g.doubt_fused as f32;
        if b.flags & (FLAG_MAP | FLAG_ANCHORS) != 0 {
            p.anchors = self.suppressor.as_ref().map_or(0, |s| s.slots());
        }
        [p.scale_geometry, p.scale_appearance, p.scale_semantic] =
            QUANTA.map(|q| q * b.rays() as f32);
        p
    }

    /// Rays, samples, signed distances, compositing, decoding and their losses. A per-sample head
    /// is run here for views only: training runs it with its gradients, and poses do not see it.
    pub fn record_forward(&self, r: &mut Recording, b: &Batch<'_>) {
        let full = self.params(b);
        let p = FieldParams { classes: self.ray_classes(), ..full };
        let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
        let (geometry, decoders) = (self.geometry.values, self.decoders.values);
        r.dispatch_1d(
            &SAMPLE_RAYS,
            &full,
            &[
                self.poses,
                self.window,
                self.color_images,
                self.depth_images,
                self.class_rarity,
                self.rays,
            ],
            rays,
        );
        r.dispatch_1d(&SAMPLE_DEPTHS, &p, &[self.rays, geometry, decoders, self.depths], rays);
        r.dispatch_1d(
            &GEOMETRY_FORWARD,
            &p,
            &[self.rays, self.depths, geometry, decoders, self.features, self.distances],
            samples,
        );
        r.dispatch_1d(
            &COMPOSITE,
            &p,
            &[
                self.rays,
                self.depths,
                self.distances,
                self.appearance.values,
                self.semantic.values,
                self.weights,
                self.ray_state,
            ],
            rays,
        );
        r.dispatch_1d(
            &DECODE_RAYS,
            &p,
            &[
                self.rays,
                decoders,
                self.ray_state,
                self.ray_out,
                self.logits_gradient,
                self.suppressor.as_ref().map_or(self.no_anchors, |s| s.anchors),
                self.targets,
                self.class_weights,
            ],
            rays,
        );
        if b.flags & (FLAG_MAP | FLAG_POSE) == 0 {
            self.record_sample_classes(r, &full);
        }
        if b.flags & FLAG_MASK != 0 {
            r.dispatch(&MASK_RAYS, &p, &[self.ray_out], [1, 1, 1]);
        }
    }

    /// Gradients down to the signed distances and, as the flags say, features and positions.
    pub fn record_backward(&self, r: &mut Recording, b: &Batch<'_>) {
        let p = self.params(b);
        let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
        let (geometry, decoders) = (self.geometry.values, self.decoders.values);
        r.dispatch_1d(
            &COMPOSITE_BACKWARD,
            &p,
            &[
                self.rays,
                self.depths,
                self.distances,
                self.weights,
                self.appearance.values,
                self.ray_state,
                self.ray_out,
                self.distance_gradient,
            ],
            rays,
        );
        if b.flags & FLAG_MAP != 0 {
            r.dispatch(
                &GEOMETRY_WEIGHTS,
                &p,
                &[self.features, self.distance_gradient, decoders, self.geometry_partials],
                [GEOMETRY_ROWS, 1, 1],
            );
        }
        r.dispatch_1d(
            &GEOMETRY_BACKWARD,
            &p,
            &[
                self.rays,
                self.depths,
                geometry,
                decoders,
                self.distance_gradient,
                self.features,
                self.position_gradient,
            ],
            samples.div_ceil(BACKWARD_STRIP as usize),
        );
        if b.flags & FLAG_POSE != 0 {
            r.dispatch_1d(
                &POSE_GRADIENT,
                &p,
                &[self.rays, self.depths, self.position_gradient, self.ray_state],
                rays,
            );
        }
        if b.flags & FLAG_MAP != 0 {
            r.dispatch_1d(
                &SCATTER_GEOMETRY,
                &p,
                &[
                    self.rays,
                    self.depths,
                    self.distance_gradient,
                    self.features,
                    self.geometry.gradient,
                    self.status,
                ],
                rays * 24,
            );
            self.record_scatter_surface(r, b);
            self.record_sample_backward(r, &p);
        }
    }

    /// Gradients of the semantics alone: what [`Device::record_semantic_step`] needs.
    pub fn record_semantic_backward(&self, r: &mut Recording, b: &Batch<'_>) {
        if self.sample_head.is_some() {
            self.record_sample_backward(r, &self.params(b));
        } else {
            self.record_scatter_surface(r, b);
        }
    }

    fn record_scatter_surface(&self, r: &mut Recording, b: &Batch<'_>) {
        let p = FieldParams { classes: self.ray_classes(), ..self.params(b) };
        let rays = p.rays as usize;
        r.dispatch_1d(
            &SCATTER_SURFACE,
            &p,
            &[
                self.rays,
                self.depths,
                self.weights,
                self.ray_state,
                self.appearance.gradient,
                self.semantic.gradient,
                self.status,
            ],
            rays * if p.classes > 0 { 48 } else { 24 },
        );
    }

    /// One Adam step of the window's poses from the last backward pass.
    pub fn record_pose_step(
        &self,
        r: &mut Recording,
        b: &Batch<'_>,
        rate_translation_m: f64,
        rate_rotation_rad: f64,
        restart: bool,
    ) {
        let p = PoseStepParams {
            rays_per_frame: b.rays_per_frame,
            restart: u32::from(restart),
            learning_rate_translation: rate_translation_m as f32,
            learning_rate_rotation: rate_rotation_rad as f32,
            weight_color: b.loss.color as f32,
            weight_depth: b.loss.depth as f32,
        };
        r.dispatch(
            &POSE_STEP,
            &p,
            &[self.ray_state, self.ray_out, self.window, self.poses, self.pose_state],
            [b.frames, 1, 1],
        );
    }

    /// Decoder gradients from the last backward pass, then Adam on everything.
    pub fn record_step(&mut self, r: &mut Recording, b: &Batch<'_>, rates: Rates) {
        r.dispatch_1d(
            &REDUCE_PARTIALS,
            &ReducePartialsParams {
                rows: GEOMETRY_ROWS,
                columns: GEOMETRY_FLOATS as u32,
                row: GEOMETRY_FLOATS as u32,
                offset: 0,
            },
            &[self.geometry_partials, self.decoders.gradient],
            GEOMETRY_FLOATS,
        );
        self.record_updates(r, b, rates, true);
    }

    /// As [`Device::record_step`], of the semantic planes, their decoder and the class head. The
    /// batch's weight of the colour must be 0.
    pub fn record_semantic_step(&mut self, r: &mut Recording, b: &Batch<'_>, rates: Rates) {
        self.record_updates(r, b, rates, false);
    }

    fn record_updates(&mut self, r: &mut Recording, b: &Batch<'_>, rates: Rates, all: bool) {
        let p = self.params(b);
        let floats = self.decoders.floats;
        let row = (floats - GEOMETRY_FLOATS) as u32;
        let chunks = p.rays.div_ceil(DECODER_CHUNK);
        // (inputs, outputs, activations, deltas, weights, bias)
        let mut layers = vec![
            (32, 32, STATE_APPEARANCE, STATE_COLOR_HIDDEN_DELTA, 0, 1024),
            (32, 4, STATE_COLOR_HIDDEN, STATE_COLOR_DELTA, 1056, 1184),
        ];
        if self.ray_classes() > 0 {
            layers.push((32, 32, STATE_SEMANTIC, STATE_SEMANTIC_HIDDEN_DELTA, 1188, 2212));
            layers.push((32, 16, STATE_SEMANTIC_HIDDEN, STATE_FEATURE_DELTA, 2244, 2756));
            layers.push((16, self.classes, STATE_FEATURE, 0, 2772, 2772 + self.classes * 16));
        }
        for (i, (inputs, outputs, x, d, weight_offset, bias_offset)) in
            layers.into_iter().enumerate()
        {
            let head = i == 4;
            r.dispatch_1d(
                &WEIGHT_GRADIENT,
                &WeightGradientParams {
                    rays: p.rays,
                    inputs,
                    outputs,
                    chunk: DECODER_CHUNK,
                    input_offset: x * 4,
                    delta_offset: d * 4,
                    from_logits: u32::from(head),
                    row,
                    weight_offset,
                    bias_offset,
                    input_stride: if head { 1 } else { outputs },
                    output_stride: if head { 16 } else { 1 },
                },
                &[self.ray_state, self.logits_gradient, self.decoder_partials],
                (chunks * (inputs + 1) * outputs.div_ceil(4)) as usize,
            );
        }
        r.dispatch_1d(
            &REDUCE_PARTIALS,
            &ReducePartialsParams {
                rows: chunks,
                columns: row,
                row,
                offset: GEOMETRY_FLOATS as u32,
            },
            &[self.decoder_partials, self.decoders.gradient],
            row as usize,
        );
        self.step += 1;
        let correction = |beta: f64| {
            (1.0 / (1.0 - num_traits::Float::powi(beta, self.step.min(1 << 20) as i32))) as f32
        };
        let (correction1, correction2) = (correction(0.9), correction(0.999));
        let mut update = |t: &Trained, scale: Option<f32>, rate: f64| {
            adam::record(
                r,
                &AdamParams {
                    offset: 0,
                    count: t.floats as u32,
                    fixed_point: u32::from(scale.is_some()),
                    gradient_limit: 1 << 30,
                    gradient_scale: scale.map_or(1.0, |s| 1.0 / s),
                    learning_rate: rate as f32,
                    beta1: 0.9,
                    beta2: 0.999,
                    epsilon: 1e-15,
                    correction1,
                    correction2,
                },
                &[t.values, t.gradient, t.moment1, t.moment2, self.status],
            );
        };
        if all {
            update(&self.geometry, Some(p.scale_geometry), rates.planes);
            update(&self.appearance, Some(p.scale_appearance), rates.planes);
        }
        if self.classes > 0 {
            update(&self.semantic, Some(p.scale_semantic), rates.planes);
        }
        update(&self.decoders, None, rates.decoders);
        self.record_sample_step(r, rates);
    }
}
