//! The state of a map.
use super::{
    batch::{Batch, ClassWeight, QUANTA, set_camera},
    fusion::Fusion,
    parameters::ParameterTensor,
    sample_head::SampleHead,
    slots::{FrameFormat, FrameSlots, TokenGrid},
    suppressor::Suppressor,
};
use crate::{
    commands::{Buffer, Commands},
    config::{Config, Head},
    engine::{Engine, EngineError},
    field::{FieldShape, decoder_floats, initial_decoders, initial_planes},
    kernels::shared::{FLAG_ANCHORS, FLAG_MAP},
    layout::FieldParams,
};
use alloc::{vec, vec::Vec};
use mte_slam_shaders::random::salt;

/// The state of a map: what outlives a pass.
pub struct Map {
    /// Bounds and grids.
    pub shape: FieldShape,
    /// Geometry planes.
    pub geometry: ParameterTensor,
    /// Appearance planes.
    pub appearance: ParameterTensor,
    /// Semantic planes (of minimal size without classes).
    pub semantic: ParameterTensor,
    /// All decoders.
    pub decoders: ParameterTensor,
    /// Multi-tier feature fusion, where there are classes.
    pub fusion: Option<Fusion>,
    /// Feature redundancy suppressor, where there are classes.
    pub suppressor: Option<Suppressor>,
    /// The per-sample class head, where it is configured and there are classes.
    pub sample_head: Option<SampleHead>,
    /// Stored frames: images, poses, fused features.
    pub frames: FrameSlots,
    /// Number of classes.
    pub classes: u32,
    /// Steps Adam has taken.
    pub step: u32,
    /// What the kernels' parameters are for every batch.
    pub(super) base: FieldParams,
    /// What Adam and scatter reported since the start.
    pub(super) status: Buffer<u32>,
    /// Weights of the classes in the cross-entropy of rays.
    pub(super) class_weights: Buffer<[f32; 2]>,
    /// How rare the classes are, for the drawing of rays.
    pub(super) class_rarity: Buffer<f32>,
    /// Weights of the classes in the cross-entropy of the fusion's tokens.
    pub(super) token_class_weights: Buffer<f32>,
    /// Stands for the anchors where there is no suppressor.
    no_anchors: Buffer<[f32; 4]>,
}

impl Map {
    /// Makes a map's buffers with their first values.
    ///
    /// # Errors
    /// [`EngineError`], with the numbers, when a buffer passes what the engine can bind.
    pub fn new(
        engine: &mut Engine,
        config: &Config,
        format: &FrameFormat,
        shape: FieldShape,
    ) -> Result<Map, EngineError> {
        let e = engine;
        let (classes, seed) = (format.classes, config.seed);
        let grid = TokenGrid::new(&format.camera, &config.fusion);
        let sample_head = if classes > 0 && config.semantics.head == Head::Sample {
            SampleHead::new(e, classes, seed)?
        } else {
            None
        };
        let per_sample = sample_head.is_some();
        // An image smaller than a token has nothing to fuse.
        let fused = classes > 0 && config.fusion.enabled && grid.tokens() > 0 && !per_sample;
        let frames = FrameSlots::new(e, config, format, fused.then_some(grid))?;
        let fusion = if fused {
            let origin = [shape.bounds.min.x, shape.bounds.min.y, shape.bounds.min.z, 0.0];
            let origin = origin.map(|x| x as f32);
            let channels = format.feature_channels;
            Some(Fusion::new(e, &config.fusion, origin, grid, classes, channels, seed)?)
        } else {
            None
        };
        let suppressor = if classes > 0 && config.suppressor.enabled && !per_sample {
            Some(Suppressor::new(e, &config.suppressor, classes)?)
        } else {
            None
        };
        let semantic_floats = if classes > 0 { shape.surface_floats() } else { 16 };
        let map = Map {
            shape,
            geometry: ParameterTensor::new(e, "geometry planes", shape.geometry_floats())?,
            appearance: ParameterTensor::new(e, "appearance planes", shape.surface_floats())?,
            semantic: ParameterTensor::new(e, "semantic planes", semantic_floats)?,
            decoders: ParameterTensor::new(e, "decoders", decoder_floats(classes))?,
            base: base_params(config, format, &shape, fused.then_some(grid)),
            fusion,
            suppressor,
            sample_head,
            frames,
            classes,
            step: 0,
            status: e.create("status", 4)?,
            class_weights: e.create("class weights", 2 * classes.max(4) as usize)?,
            class_rarity: e.create("class rarity", classes.max(4) as usize)?,
            token_class_weights: e.create("token class weights", classes.max(4) as usize)?,
            no_anchors: e.create("no anchors", 4)?,
        };
        let mut r = Commands::default();
        r.upload(
            map.geometry.values,
            0,
            &initial_planes(map.geometry.floats, seed, salt::GEOMETRY_PLANES),
        );
        r.upload(
            map.appearance.values,
            0,
            &initial_planes(map.appearance.floats, seed, salt::APPEARANCE_PLANES),
        );
        r.upload(
            map.semantic.values,
            0,
            &initial_planes(map.semantic.floats, seed, salt::SEMANTIC_PLANES),
        );
        r.upload(map.decoders.values, 0, &initial_decoders(classes, seed));
        let equal = vec![ClassWeight { weight: 1.0, adjustment: 0.0 }; classes as usize];
        let ones = vec![1.0; classes as usize];
        map.upload_class_weights(&mut r, &equal, &ones, &ones);
        e.submit(&r)?;
        Ok(map)
    }

    /// Number of slots of frames; slot 0 is for tracking and views.
    pub fn slots(&self) -> u32 {
        self.frames.count
    }

    /// The kernels' parameters for a batch.
    pub(super) fn params(&self, b: &Batch<'_>) -> FieldParams {
        let mut p = self.base;
        if let Some(camera) = b.camera {
            set_camera(&mut p, camera);
        }
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
        let s = &b.supervision;
        p.weight_compression = s.compression as f32;
        p.weight_feature = s.feature as f32;
        p.doubt_anchor = s.doubt_anchor as f32;
        p.doubt_fused = s.doubt_fused as f32;
        if b.flags & (FLAG_MAP | FLAG_ANCHORS) != 0 {
            p.anchors = self.anchor_slots();
        }
        [p.scale_geometry, p.scale_appearance, p.scale_semantic] =
            QUANTA.map(|q| q * b.rays() as f32);
        p
    }

    /// Classes that are decoded once per ray: none with a per-sample head.
    pub(super) fn ray_classes(&self) -> u32 {
        if self.sample_head.is_some() { 0 } else { self.classes }
    }

    /// The anchors, or what stands for them.
    pub(super) fn anchors(&self) -> Buffer<[f32; 4]> {
        self.suppressor.as_ref().map_or(self.no_anchors, |s| s.anchors)
    }

    /// Number of slots of anchors; 0 without a suppressor.
    pub(super) fn anchor_slots(&self) -> u32 {
        self.suppressor.as_ref().map_or(0, Suppressor::slots)
    }

    /// Training steps of the fusion so far.
    pub fn fusion_steps(&self) -> u32 {
        self.fusion.as_ref().map_or(0, Fusion::steps)
    }

    /// Sets how classes count in the cross-entropy of rays, their weights in that of the fusion, and
    /// how rare they are; one value per class.
    pub fn upload_class_weights(
        &self,
        r: &mut Commands,
        rays: &[ClassWeight],
        fusion: &[f32],
        rarity: &[f32],
    ) {
        r.upload(self.class_rarity, 0, rarity);
        r.upload(self.class_weights, 0, rays);
        r.upload(self.token_class_weights, 0, fusion);
    }

    /// What Adam and scatter reported since the start: bit 0 saturated, bit 1 not finite.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn read_status(&self, engine: &mut Engine) -> Result<u32, EngineError> {
        Ok(engine.read(self.status, 0, 1).await?[0])
    }

    /// Replaces the planes by larger ones; every old cell keeps its value and moments.
    ///
    /// # Errors
    /// Engine failures, such as planes that pass what the engine can bind.
    pub async fn grow(
        &mut self,
        engine: &mut Engine,
        shape: FieldShape,
        seed: u32,
    ) -> Result<(), EngineError> {
        let old = self.shape;
        let semantic_floats = if self.classes > 0 { shape.surface_floats() } else { 0 };
        let grids = [
            (self.geometry, false, shape.geometry_floats(), salt::GEOMETRY_PLANES),
            (self.appearance, true, shape.surface_floats(), salt::APPEARANCE_PLANES),
            (self.semantic, true, semantic_floats, salt::SEMANTIC_PLANES),
        ];
        let mut new = [self.geometry, self.appearance, self.semantic];
        for (i, (t, surface, floats, salt)) in grids.into_iter().enumerate() {
            if floats == 0 {
                continue;
            }
            let names = ["geometry planes", "appearance planes", "semantic planes"];
            let larger = ParameterTensor::new(engine, names[i], floats)?;
            for (from, to, first) in [
                (t.values.id(), larger.values.id(), initial_planes(floats, seed, salt)),
                (t.moment1.id(), larger.moment1.id(), vec![0.0; floats]),
                (t.moment2.id(), larger.moment2.id(), vec![0.0; floats]),
            ] {
                let values: Vec<f32> = engine.read_as(from, 0, t.floats).await?;
                let mut fresh = first;
                shape.carry_over(&old, surface, &values, &mut fresh);
                let mut r = Commands::default();
                r.upload(to, 0, &fresh);
                engine.submit(&r)?;
            }
            t.destroy(engine);
            new[i] = larger;
        }
        [self.geometry, self.appearance, self.semantic] = new;
        self.shape = shape;
        shape.fill(&mut self.base);
        Ok(())
    }
}

/// The part of the kernels' parameters that no batch changes.
fn base_params(
    config: &Config,
    format: &FrameFormat,
    shape: &FieldShape,
    tokens: Option<TokenGrid>,
) -> FieldParams {
    let mut base: FieldParams = bytemuck::Zeroable::zeroed();
    set_camera(&mut base, &format.camera);
    base.depth_unit = format.depth_unit_m as f32;
    base.truncation = config.field.truncation_m as f32;
    base.sharpness = config.field.sharpness as f32;
    base.near = config.sampling.near_m as f32;
    base.seed = config.seed;
    base.classes = format.classes;
    base.min_weight = config.sampling.min_weight as f32;
    base.rare_draws = config.sampling.rare_draws;
    base.decoder_stride = config.mapping.decoder_stride;
    base.contribution_limit = 4_194_304.0;
    base.min_gradient = config.mapping.min_gradient as f32;
    let t = &config.tracking;
    base.inv_sigma_distance = (1.0 / t.align_sigma_distance_m) as f32;
    base.inv_sigma_intensity = (1.0 / t.align_sigma_intensity) as f32;
    base.robust_distance = (2.0 * t.align_sigma_distance_m) as f32;
    base.robust_intensity = (2.0 * t.align_sigma_intensity) as f32;
    shape.fill(&mut base);
    if let Some(grid) = tokens {
        base.token_columns = grid.columns;
        base.token_rows = grid.rows;
        base.token_size = grid.token_pixels;
    }
    base
}
