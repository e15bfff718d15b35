//! The buffers of one batch.
use super::{FusionScratch, Map, SampleScratch};
use crate::{
    commands::{Buffer, Commands},
    config::Config,
    engine::{Engine, EngineError},
    field::decoder_floats,
    kernels::shared::{RAY_WORDS, Ray},
    layout::{GEOMETRY_FLOATS, RAY_OUT_FLOATS, RAY_STATE_FLOATS},
};
use alloc::vec::Vec;

/// Workgroups (rows of partial sums) of the geometry decoder's gradient.
pub(super) const GEOMETRY_ROWS: u32 = 64;
/// Rays per row of partial sums of the per-ray decoders.
pub(super) const DECODER_CHUNK: u32 = 250;
/// Points a query holds at most.
pub(super) const QUERY_POINTS_MAX: usize = 1 << 17;
/// Most frames a window holds.
pub(crate) const WINDOW_MAX: usize = 64;

/// The buffers of a batch: passes write them before they read them, so they are no state.
pub struct Scratch {
    /// Most rays of any batch.
    pub max_rays: u32,
    /// Activations and gradients of the fusion, where the map has one.
    pub fusion: Option<FusionScratch>,
    /// The same of the per-sample class head.
    #[cfg_attr(
        not(feature = "sample-head"),
        expect(dead_code, reason = "nothing but that head reads it")
    )]
    pub(super) sample_head: Option<SampleScratch>,
    /// Slots of the window's frames; bit 31: the pose is fixed.
    pub(super) window: Buffer<u32>,
    pub(super) rays: Buffer<Ray>,
    pub(super) depths: Buffer<f32>,
    pub(super) distances: Buffer<f32>,
    pub(super) weights: Buffer<f32>,
    pub(super) distance_gradient: Buffer<f32>,
    pub(super) features: Buffer<[f32; 4]>,
    pub(super) position_gradient: Buffer<[f32; 4]>,
    pub(super) ray_state: Buffer<[f32; 4]>,
    pub(super) ray_out: Buffer<[f32; 4]>,
    pub(super) logits_gradient: Buffer<f32>,
    pub(super) geometry_partials: Buffer<[f32; 4]>,
    pub(super) decoder_partials: Buffer<f32>,
    /// Points of a query.
    pub(super) points: Buffer<[f32; 4]>,
    /// What a query found at them.
    pub(super) values: Buffer<f32>,
}

impl Scratch {
    /// Makes the buffers for batches as large as the configuration asks for.
    ///
    /// # Errors
    /// [`EngineError`], with the numbers, when a buffer passes what the engine can bind.
    pub fn new(engine: &mut Engine, config: &Config, map: &Map) -> Result<Scratch, EngineError> {
        let e = engine;
        let classes = map.classes;
        let s = &config.sampling;
        let max_rays = config.mapping.rays.max(config.tracking.render_rays) as usize;
        let samples = (s.stratified + s.surface) as usize;
        let render_samples = (s.render_stratified + s.render_surface) as usize;
        let total = max_rays * samples.max(render_samples);
        let trained_samples = max_rays * samples;
        let rows = max_rays.div_ceil(DECODER_CHUNK as usize);
        let fusion = match &map.fusion {
            Some(f) => Some(FusionScratch::new(e, f, classes)?),
            None => None,
        };
        let sample_head = match &map.sample_head {
            Some(h) => Some(SampleScratch::new(e, h, classes, trained_samples, max_rays)?),
            None => None,
        };
        Ok(Scratch {
            max_rays: max_rays as u32,
            fusion,
            sample_head,
            window: e.create("window", WINDOW_MAX)?,
            rays: e.create("rays", max_rays * RAY_WORDS)?,
            depths: e.create("sample depths", total)?,
            distances: e.create("distances", total)?,
            weights: e.create("weights", total)?,
            distance_gradient: e.create("distance gradients", total)?,
            features: e.create("features", trained_samples * 32)?,
            position_gradient: e.create("position gradients", trained_samples * 4)?,
            ray_state: e.create("ray state", max_rays * RAY_STATE_FLOATS)?,
            ray_out: e.create("ray outputs", max_rays * RAY_OUT_FLOATS)?,
            logits_gradient: e.create("logits", (max_rays * classes as usize).max(4))?,
            geometry_partials: e
                .create("geometry partials", GEOMETRY_ROWS as usize * GEOMETRY_FLOATS)?,
            decoder_partials: e
                .create("decoder partials", rows * (decoder_floats(classes) - GEOMETRY_FLOATS))?,
            points: e.create("points", QUERY_POINTS_MAX * 4)?,
            values: e.create("values", QUERY_POINTS_MAX * 8)?,
        })
    }

    /// Sets the window: slots, and whether each pose is fixed.
    pub fn upload_window(&self, r: &mut Commands, window: &[(u32, bool)]) {
        let words: Vec<u32> =
            window.iter().map(|(slot, fixed)| slot | (u32::from(*fixed) << 31)).collect();
        r.upload(self.window, 0, &words);
    }

    /// The rays' outputs of the last forward pass: [`RAY_OUT_FLOATS`] per ray.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn read_ray_out(
        &self,
        engine: &mut Engine,
        rays: u32,
    ) -> Result<Vec<f32>, EngineError> {
        engine.read_as(self.ray_out, 0, rays as usize * RAY_OUT_FLOATS).await
    }

    /// What the rays of the last forward pass keep: [`RAY_STATE_FLOATS`] per ray.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn read_ray_state(
        &self,
        engine: &mut Engine,
        rays: u32,
    ) -> Result<Vec<f32>, EngineError> {
        engine.read_as(self.ray_state, 0, rays as usize * RAY_STATE_FLOATS).await
    }
}
