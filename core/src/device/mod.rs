//! The map's buffers on an engine, and the recordings of one pass over a batch of rays.
mod fusion;
mod passes;
mod sample_head;
mod state;
mod suppressor;

pub use fusion::{FeatureMaps, Fusion, Layer};
pub use sample_head::{SampleHead, SampleLayer};
pub(crate) use state::Counters;
pub use suppressor::{AnchorCounts, Suppressor};

use crate::{
    camera::Camera,
    classes::UNLABELLED,
    config::{Config, Head, LossConfig},
    engine::{Engine, EngineError},
    field::{FieldShape, decoder_floats, initial_decoders, initial_planes},
    frame::Frame,
    kernels::{
        align_points::{ALIGN_POINTS, ALIGN_ROW},
        pose_step::POSE_STATE_FLOATS,
        query_points::QUERY_POINTS,
        shared::{FLAG_ANCHORS, FLAG_MAP, RAY_WORDS},
    },
    layout::{FieldParams, GEOMETRY_FLOATS, RAY_OUT_FLOATS, RAY_STATE_FLOATS, TARGET_FLOATS},
    pose::Pose,
    recording::{BufferId, Recording},
};
use alloc::{vec, vec::Vec};
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

/// Workgroups (rows of partial sums) of the geometry decoder's gradient.
const GEOMETRY_ROWS: u32 = 64;
/// Rays a row of partial sums of the per-ray decoders.
const DECODER_CHUNK: u32 = 250;
/// Points a query holds at most.
pub const QUERY_POINTS_MAX: usize = 1 << 17;
/// Most frames a window holds.
pub const WINDOW_MAX: usize = 64;
/// Fixed-point quanta per unit of gradient and ray. A surface hit by every ray of a batch stays
/// 2^10 below saturation; a residual of 1e-4 still moves several quanta.
const QUANTA: [f32; 3] = [262_144.0, 262_144.0, 1_048_576.0];

/// A parameter tensor with what Adam keeps beside it.
#[derive(Clone, Copy, Debug)]
pub struct Trained {
    /// Values.
    pub values: BufferId,
    /// Gradients: fixed-point i32 for planes, f32 for decoders.
    pub gradient: BufferId,
    /// First moments.
    pub moment1: BufferId,
    /// Second moments.
    pub moment2: BufferId,
    /// Number of floats.
    pub floats: usize,
}

impl Trained {
    fn new(engine: &mut Engine, name: &'static str, floats: usize) -> Result<Trained, EngineError> {
        Ok(Trained {
            values: engine.create_buffer(name, floats)?,
            gradient: engine.create_buffer(name, floats)?,
            moment1: engine.create_buffer(name, floats)?,
            moment2: engine.create_buffer(name, floats)?,
            floats,
        })
    }

    fn destroy(&self, engine: &mut Engine) {
        for b in [self.values, self.gradient, self.moment1, self.moment2] {
            engine.destroy_buffer(b);
        }
    }
}

/// One batch of rays.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// Window frames, each with the same number of rays.
    pub frames: u32,
    /// Rays of each frame.
    pub rays_per_frame: u32,
    /// Stratified samples a ray.
    pub stratified: u32,
    /// Second-round samples a ray.
    pub surface: u32,
    /// `FLAG_*`.
    pub flags: u32,
    /// Loss weights.
    pub loss: &'a LossConfig,
    /// Counter for the random numbers.
    pub iteration: u32,
    /// First pixel of a dense batch.
    pub first: u32,
    /// Share of the rays that seek rare classes.
    pub rare_share: f64,
    /// What fusion and suppressor say about the rays' semantics.
    pub guidance: Guidance,
}

/// How a class counts in the cross-entropy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ClassWeight {
    /// Weight of labels of the class.
    pub weight: f32,
    /// Added to its logit in the loss, and nowhere else.
    pub adjustment: f32,
}

/// How fusion and suppressor guide a batch's semantics; all zero: not at all.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guidance {
    /// Weight of the compression loss.
    pub compression: f64,
    /// Weight of the feature loss.
    pub feature: f64,
    /// How fast trust in a label falls with the squared distance of its nearest anchor.
    pub doubt_anchor: f64,
    /// How fast trust in a label falls with its logit at the pixel's fused feature.
    pub doubt_fused: f64,
}

impl Batch<'_> {
    fn rays(&self) -> u32 {
        self.frames * self.rays_per_frame
    }
    fn samples(&self) -> u32 {
        self.stratified + self.surface
    }
}

/// Step sizes of one optimisation step.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Plane features.
    pub planes: f64,
    /// Decoders.
    pub decoders: f64,
}

/// Poses as the device holds them: rotation row-major, translation.
pub fn pose_words(pose: &Pose) -> [f32; 12] {
    let m = pose.to_row_major();
    [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[3], m[7], m[11]].map(|x| x as f32)
}

/// The inverse of [`pose_words`], orthonormalised; `None` when a number is not finite.
pub fn pose_from_words(w: &[f32]) -> Option<Pose> {
    let v = |i: usize| f64::from(w[i]);
    let pose = Pose {
        rotation: DMat3::from_cols(
            DVec3::new(v(0), v(3), v(6)),
            DVec3::new(v(1), v(4), v(7)),
            DVec3::new(v(2), v(5), v(8)),
        ),
        translation: DVec3::new(v(9), v(10), v(11)),
    };
    pose.is_finite().then(|| pose.orthonormalised())
}

/// Buffers of the map, of the stored frames, and scratch space of a batch.
pub struct Device {
    /// The engine.
    pub engine: Engine,
    /// Bounds and grids.
    pub shape: FieldShape,
    /// Geometry planes.
    pub geometry: Trained,
    /// Appearance planes.
    pub appearance: Trained,
    /// Semantic planes (of minimal size without classes).
    pub semantic: Trained,
    /// All decoders.
    pub decoders: Trained,
    /// Multi-tier feature fusion, where there are classes.
    pub fusion: Option<Fusion>,
    /// Feature redundancy suppressor, where there are classes.
    pub suppressor: Option<Suppressor>,
    /// The per-sample class head, where it is configured and there are classes.
    pub sample_head: Option<SampleHead>,
    /// Number of classes.
    pub classes: u32,
    /// Steps Adam has taken.
    pub step: u32,
    /// Storage slots of frames; slot 0 is the current frame.
    pub slots: u32,
    camera: Camera,
    base: FieldParams,
    status: BufferId,
    poses: BufferId,
    window: BufferId,
    pose_state: BufferId,
    color_images: BufferId,
    depth_images: BufferId,
    rays: BufferId,
    depths: BufferId,
    distances: BufferId,
    weights: BufferId,
    distance_gradient: BufferId,
    features: BufferId,
    position_gradient: BufferId,
    ray_state: BufferId,
    ray_out: BufferId,
    logits_gradient: BufferId,
    geometry_partials: BufferId,
    decoder_partials: BufferId,
    /// Stands for the anchors where there is no suppressor.
    no_anchors: BufferId,
    /// Weights of the classes in the cross-entropy of rays.
    class_weights: BufferId,
    /// How rare the classes are, for the drawing of rays.
    class_rarity: BufferId,
    /// The same in the fusion's.
    token_class_weights: BufferId,
    /// Fused features of all slots' tokens.
    targets: BufferId,
    points: BufferId,
    values: BufferId,
    max_rays: u32,
}

impl Device {
    /// Makes every buffer and the map's first values. Fails, with the numbers, when a buffer
    /// passes what the engine can bind.
    pub fn new(
        engine: Engine,
        config: &Config,
        camera: Camera,
        depth_unit_m: f64,
        classes: u32,
        shape: FieldShape,
    ) -> Result<Device, EngineError> {
        Self::with_features(engine, config, camera, depth_unit_m, classes, 0, shape)
    }

    /// As [`Device::new`], for frames with feature maps of so many channels (0 for none): the fusion
    /// reads them in place of label histograms.
    pub fn with_features(
        mut engine: Engine,
        config: &Config,
        camera: Camera,
        depth_unit_m: f64,
        classes: u32,
        feature_channels: u32,
        shape: FieldShape,
    ) -> Result<Device, EngineError> {
        let e = &mut engine;
        let pixels = camera.pixels();
        // An image smaller than a token has nothing to fuse.
        let targets = fusion::target_floats(&camera, &config.fusion);
        let per_sample = classes > 0 && config.semantics.head == Head::Sample;
        let fused = classes > 0 && config.fusion.enabled && targets > 0 && !per_sample;
        let targets = if fused { targets } else { 0 };
        let maps = if fused { targets / TARGET_FLOATS * feature_channels as usize } else { 0 };
        let slot_bytes = pixels * 4 + pixels.div_ceil(2) * 4 + (targets + maps) * 4;
        let by_limit = e.max_buffer_words() / pixels.max(targets).max(maps);
        let slots = (config.keyframes.budget_mib as usize * (1 << 20) / slot_bytes)
            .min(by_limit)
            .clamp(4, 1024) as u32;
        let s = &config.sampling;
        let max_rays = config.mapping.rays.max(config.tracking.render_rays) as usize;
        let samples = (s.stratified + s.surface) as usize;
        let render_samples = (s.render_stratified + s.render_surface) as usize;
        let total = max_rays * samples.max(render_samples);
        let trained_samples = max_rays * samples;
        let semantic_floats = if classes > 0 { shape.surface_floats() } else { 16 };
        let rows = max_rays.div_ceil(DECODER_CHUNK as usize);
        let mut base: FieldParams = bytemuck::Zeroable::zeroed();
        base.width = camera.width;
        base.height = camera.height;
        base.fx = camera.fx as f32;
        base.fy = camera.fy as f32;
        base.cx = camera.cx as f32;
        base.cy = camera.cy as f32;
        base.depth_unit = depth_unit_m as f32;
        base.truncation = config.field.truncation_m as f32;
        base.sharpness = config.field.sharpness as f32;
        base.near = s.near_m as f32;
        base.seed = config.seed;
        base.classes = classes;
        base.min_weight = s.min_weight as f32;
        base.rare_draws = s.rare_draws;
        base.decoder_stride = config.mapping.decoder_stride;
        base.contribution_limit = 4_194_304.0;
        base.min_gradient = config.mapping.min_gradient as f32;
        let t = &config.tracking;
        base.inv_sigma_distance = (1.0 / t.align_sigma_distance_m) as f32;
        base.inv_sigma_intensity = (1.0 / t.align_sigma_intensity) as f32;
        base.robust_distance = (2.0 * t.align_sigma_distance_m) as f32;
        base.robust_intensity = (2.0 * t.align_sigma_intensity) as f32;
        shape.fill(&mut base);
        let fusion = if fused {
            let origin = [shape.bounds.min.x, shape.bounds.min.y, shape.bounds.min.z, 0.0];
            let f = config.fusion.clone();
            let origin = origin.map(|x| x as f32);
            let maps = FeatureMaps {
                channels: feature_channels,
                buffer: e.create_buffer("feature maps", (slots as usize * maps).max(4))?,
            };
            Some(Fusion::new(e, &f, origin, &camera, classes, maps, config.seed)?)
        } else {
            None
        };
        if let Some(f) = &fusion {
            base.token_columns = f.columns;
            base.token_rows = f.rows;
            base.token_size = config.fusion.token_pixels;
        }
        let suppressor = if classes > 0 && config.suppressor.enabled && !per_sample {
            Some(Suppressor::new(e, &config.suppressor, classes)?)
        } else {
            None
        };
        let sample_head = if per_sample {
            Some(SampleHead::new(e, classes, trained_samples, max_rays, config.seed)?)
        } else {
            None
        };
        let device = Device {
            shape,
            geometry: Trained::new(e, "geometry planes", shape.geometry_floats())?,
            appearance: Trained::new(e, "appearance planes", shape.surface_floats())?,
            semantic: Trained::new(e, "semantic planes", semantic_floats)?,
            decoders: Trained::new(e, "decoders", decoder_floats(classes))?,
            fusion,
            suppressor,
            sample_head,
            classes,
            step: 0,
            slots,
            camera,
            base,
            status: e.create_buffer("status", 4)?,
            poses: e.create_buffer("poses", slots as usize * 12)?,
            window: e.create_buffer("window", WINDOW_MAX)?,
            pose_state: e.create_buffer("pose state", slots as usize * POSE_STATE_FLOATS)?,
            color_images: e.create_buffer("colour images", slots as usize * pixels)?,
            depth_images: e.create_buffer("depth images", slots as usize * pixels.div_ceil(2))?,
            rays: e.create_buffer("rays", max_rays * RAY_WORDS)?,
            depths: e.create_buffer("sample depths", total)?,
            distances: e.create_buffer("distances", total)?,
            weights: e.create_buffer("weights", total)?,
            distance_gradient: e.create_buffer("distance gradients", total)?,
            features: e.create_buffer("features", trained_samples * 32)?,
            position_gradient: e.create_buffer("position gradients", trained_samples * 4)?,
            ray_state: e.create_buffer("ray state", max_rays * RAY_STATE_FLOATS)?,
            ray_out: e.create_buffer("ray outputs", max_rays * RAY_OUT_FLOATS)?,
            logits_gradient: e.create_buffer("logits", (max_rays * classes as usize).max(4))?,
            geometry_partials: e
                .create_buffer("geometry partials", GEOMETRY_ROWS as usize * GEOMETRY_FLOATS)?,
            decoder_partials: e.create_buffer(
                "decoder partials",
                rows * (decoder_floats(classes) - GEOMETRY_FLOATS),
            )?,
            no_anchors: e.create_buffer("no anchors", 4)?,
            class_weights: e.create_buffer("class weights", 2 * classes.max(4) as usize)?,
            class_rarity: e.create_buffer("class rarity", classes.max(4) as usize)?,
            token_class_weights: e.create_buffer("token class weights", classes.max(4) as usize)?,
            targets: e.create_buffer("targets", (slots as usize * targets).max(4))?,
            points: e.create_buffer("points", QUERY_POINTS_MAX * 4)?,
            values: e.create_buffer("values", QUERY_POINTS_MAX * 8)?,
            max_rays: max_rays as u32,
            engine,
        };
        let mut device = device;
        let mut r = Recording::default();
        let seed = config.seed;
        r.upload(device.geometry.values, 0, &initial_planes(device.geometry.floats, seed, 0));
        r.upload(device.appearance.values, 0, &initial_planes(device.appearance.floats, seed, 1));
        r.upload(device.semantic.values, 0, &initial_planes(device.semantic.floats, seed, 2));
        r.upload(device.decoders.values, 0, &initial_decoders(classes, seed));
        let equal = vec![ClassWeight { weight: 1.0, adjustment: 0.0 }; classes as usize];
        let ones = vec![1.0; classes as usize];
        device.upload_class_weights(&mut r, &equal, &ones, &ones);
        device.engine.submit(&r)?;
        Ok(device)
    }

    /// Classes that are decoded once a ray: none with a per-sample head.
    fn ray_classes(&self) -> u32 {
        if self.sample_head.is_some() { 0 } else { self.classes }
    }

    /// Largest batch a dense pass may have.
    pub fn max_rays(&self) -> u32 {
        self.max_rays
    }

    /// Colour and label of a frame's pixels, as slots hold them.
    pub fn color_words(frame: &Frame) -> Vec<[u8; 4]> {
        let label = |i: usize| frame.labels.as_ref().map_or(UNLABELLED, |l| l[i]);
        frame.color.iter().enumerate().map(|(i, c)| [c[0], c[1], c[2], label(i)]).collect()
    }

    /// Puts a frame's images into a slot, and forgets the pose optimiser's state of the slot's former frame.
    pub fn upload_frame(&self, r: &mut Recording, slot: u32, frame: &Frame) {
        let pixels = self.camera.pixels();
        let color = Device::color_words(frame);
        let depth: Vec<u32> = frame
            .depth
            .chunks(2)
            .map(|d| u32::from(d[0]) | d.get(1).map_or(0, |x| u32::from(*x) << 16))
            .collect();
        r.upload(self.color_images, slot as usize * pixels, &color);
        r.upload(self.depth_images, slot as usize * pixels.div_ceil(2), &depth);
        r.clear(self.pose_state, slot as usize * POSE_STATE_FLOATS, POSE_STATE_FLOATS);
        if let (Some(f), Some(map)) = (&self.fusion, &frame.features) {
            f.upload_features(r, slot, map, &self.camera);
        }
    }

    /// How classes count in the cross-entropy of rays, their weights in that of the fusion, and how
    /// rare they are; one a class.
    pub fn upload_class_weights(
        &self,
        r: &mut Recording,
        rays: &[ClassWeight],
        fusion: &[f32],
        rarity: &[f32],
    ) {
        r.upload(self.class_rarity, 0, rarity);
        r.upload(self.class_weights, 0, rays);
        r.upload(self.token_class_weights, 0, fusion);
    }

    /// Colour and label of a slot's pixels.
    pub async fn read_color(&mut self, slot: u32) -> Result<Vec<[u8; 4]>, EngineError> {
        let pixels = self.camera.pixels();
        let words = self.engine.read(self.color_images, slot as usize * pixels, pixels).await?;
        Ok(words.into_iter().map(u32::to_le_bytes).collect())
    }

    /// Replaces colour and label of a slot's pixels.
    pub fn upload_color(&self, r: &mut Recording, slot: u32, image: &[[u8; 4]]) {
        r.upload(self.color_images, slot as usize * self.camera.pixels(), image);
    }

    /// Sets the pose of a slot.
    pub fn upload_pose(&self, r: &mut Recording, slot: u32, pose: &Pose) {
        r.upload(self.poses, slot as usize * 12, &pose_words(pose));
    }

    /// Sets the window: slots, and whether each pose is fixed.
    pub fn upload_window(&self, r: &mut Recording, window: &[(u32, bool)]) {
        let words: Vec<u32> =
            window.iter().map(|(slot, fixed)| slot | (u32::from(*fixed) << 31)).collect();
        r.upload(self.window, 0, &words);
    }

    /// Poses of all slots up to `count`.
    pub async fn read_poses(&mut self, count: u32) -> Result<Vec<Option<Pose>>, EngineError> {
        let words: Vec<f32> = self.engine.read_as(self.poses, 0, count as usize * 12).await?;
        Ok(words.chunks_exact(12).map(pose_from_words).collect())
    }

    /// The rays' outputs of the last forward pass: [`RAY_OUT_FLOATS`] a ray.
    pub async fn read_ray_out(&mut self, rays: u32) -> Result<Vec<f32>, EngineError> {
        self.engine.read_as(self.ray_out, 0, rays as usize * RAY_OUT_FLOATS).await
    }

    /// What the rays of the last forward pass keep: [`RAY_STATE_FLOATS`] a ray.
    pub async fn read_ray_state(&mut self, rays: u32) -> Result<Vec<f32>, EngineError> {
        self.engine.read_as(self.ray_state, 0, rays as usize * RAY_STATE_FLOATS).await
    }

    /// Pose state of a slot after [`Device::record_pose_step`].
    pub async fn read_pose_state(&mut self, slot: u32) -> Result<Vec<f32>, EngineError> {
        let at = slot as usize * POSE_STATE_FLOATS;
        self.engine.read_as(self.pose_state, at, POSE_STATE_FLOATS).await
    }

    /// What Adam and scatter reported since the start: bit 0 saturated, bit 1 not finite.
    pub async fn read_status(&mut self) -> Result<u32, EngineError> {
        Ok(self.engine.read(self.status, 0, 1).await?[0])
    }

    /// Uploads camera-frame points (x, y, z \[m\], intensity) for [`Device::align`].
    pub fn upload_pixels(&self, r: &mut Recording, pixels: &[[f32; 4]]) {
        r.upload(self.points, 0, pixels);
    }

    /// Sums of the normal equations over the uploaded pixels at a pose; see `align_points`.
    pub async fn align(
        &mut self,
        pose: &Pose,
        count: u32,
    ) -> Result<[f64; ALIGN_ROW], EngineError> {
        let mut r = Recording::default();
        self.upload_pose(&mut r, 0, pose);
        let mut p = self.base;
        p.rays = count;
        r.dispatch_1d(
            &ALIGN_POINTS,
            &p,
            &[
                self.poses,
                self.points,
                self.geometry.values,
                self.appearance.values,
                self.decoders.values,
                self.values,
            ],
            count as usize,
        );
        self.engine.submit(&r)?;
        let groups = count.div_ceil(64) as usize;
        let rows: Vec<f32> = self.engine.read_as(self.values, 0, groups * ALIGN_ROW).await?;
        let mut sums = [0.0; ALIGN_ROW];
        for row in rows.chunks_exact(ALIGN_ROW) {
            for (s, v) in sums.iter_mut().zip(row) {
                *s += f64::from(*v);
            }
        }
        Ok(sums)
    }

    /// Signed distances \[truncations\] at points, at most [`QUERY_POINTS_MAX`].
    pub async fn query_distances(&mut self, points: &[[f32; 4]]) -> Result<Vec<f32>, EngineError> {
        self.query(points, 0, 1).await
    }

    /// 8 floats a point: distance, class (bits; the nearest anchor's or the head's), 0, 0, red, green,
    /// blue, 0.
    pub async fn query_surface(
        &mut self,
        points: &[[f32; 4]],
        by_anchors: bool,
    ) -> Result<Vec<f32>, EngineError> {
        let flags = FLAG_MAP | if by_anchors { FLAG_ANCHORS } else { 0 };
        let mut values = self.query(points, flags, 8).await?;
        if self.sample_head.is_some() {
            let classes = self.sample_classes(points).await?;
            for (value, class) in values.chunks_exact_mut(8).zip(classes) {
                value[1] = f32::from_bits(class);
            }
        }
        Ok(values)
    }

    async fn query(
        &mut self,
        points: &[[f32; 4]],
        flags: u32,
        floats: usize,
    ) -> Result<Vec<f32>, EngineError> {
        let mut out = Vec::with_capacity(points.len() * floats);
        for chunk in points.chunks(QUERY_POINTS_MAX) {
            let mut r = Recording::default();
            r.upload(self.points, 0, chunk);
            let mut p = self.base;
            p.rays = chunk.len() as u32;
            p.flags = flags;
            p.classes = self.ray_classes();
            p.anchors = self.suppressor.as_ref().map_or(0, Suppressor::slots);
            r.dispatch_1d(
                &QUERY_POINTS,
                &p,
                &[
                    self.points,
                    self.geometry.values,
                    self.appearance.values,
                    self.semantic.values,
                    self.decoders.values,
                    self.suppressor.as_ref().map_or(self.no_anchors, |s| s.anchors),
                    self.values,
                ],
                chunk.len(),
            );
            self.engine.submit(&r)?;
            out.extend(self.engine.read_as::<f32>(self.values, 0, chunk.len() * floats).await?);
        }
        Ok(out)
    }

    /// Replaces the planes by larger ones; every old cell keeps its value and moments.
    pub async fn grow(&mut self, shape: FieldShape, seed: u32) -> Result<(), EngineError> {
        let old = self.shape;
        let grids = [
            (self.geometry, false, shape.geometry_floats(), 0),
            (self.appearance, true, shape.surface_floats(), 1),
            (self.semantic, true, if self.classes > 0 { shape.surface_floats() } else { 0 }, 2),
        ];
        let mut new = [self.geometry, self.appearance, self.semantic];
        for (i, (t, surface, floats, salt)) in grids.into_iter().enumerate() {
            if floats == 0 {
                continue;
            }
            let names = ["geometry planes", "appearance planes", "semantic planes"];
            let larger = Trained::new(&mut self.engine, names[i], floats)?;
            for (from, to, first) in [
                (t.values, larger.values, initial_planes(floats, seed, salt)),
                (t.moment1, larger.moment1, vec![0.0; floats]),
                (t.moment2, larger.moment2, vec![0.0; floats]),
            ] {
                let values: Vec<f32> = self.engine.read_as(from, 0, t.floats).await?;
                let mut fresh = first;
                shape.carry_over(&old, surface, &values, &mut fresh);
                let mut r = Recording::default();
                r.upload(to, 0, &fresh);
                self.engine.submit(&r)?;
            }
            t.destroy(&mut self.engine);
            new[i] = larger;
        }
        [self.geometry, self.appearance, self.semantic] = new;
        self.shape = shape;
        shape.fill(&mut self.base);
        Ok(())
    }

    /// Renders through another camera from now on (dense batches only use its size and intrinsics;
    /// stored frames keep theirs, so reset it before mapping).
    pub fn set_camera(&mut self, camera: &Camera) {
        self.base.width = camera.width;
        self.base.height = camera.height;
        self.base.fx = camera.fx as f32;
        self.base.fy = camera.fy as f32;
        self.base.cx = camera.cx as f32;
        self.base.cy = camera.cy as f32;
    }
}
