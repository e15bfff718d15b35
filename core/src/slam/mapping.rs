//! Adding a frame to the map: bounds, keyframes, windows, optimisation, corrected poses.
use super::semantics::steps_due;
use super::{Breathe, Losses, Observation, Slam, SlamError};
use crate::{
    config::{RefinePoses, Tracker},
    engine::Engine,
    field::FieldShape,
    frame::{Bounds, Frame},
    kernels::shared::{FLAG_GUIDED, FLAG_MAP, FLAG_POSE, random_u32},
    keyframe::{Keyframe, overlap, sample_points},
    layout::RAY_OUT_FLOATS,
    map::{
        Batch, FrameFormat, Map, Rates, Scratch, SemanticSupervision, WINDOW_MAX, fusion, passes,
        suppressor,
    },
    recording::Recording,
};
use alloc::{collections::BTreeSet, vec::Vec};
use glam::DVec3;

/// Depth images kept for culling are at most this wide.
const OBSERVATION_WIDTH: u32 = 160;
/// Iterations recorded at once: long enough to amortise, short enough for watchdogs.
const ITERATIONS_PER_RECORDING: u32 = 4;
/// Iterations of a part of the last optimisation.
const FINISH_ITERATIONS: u32 = 20;
/// Joint pose refinement needs more keyframes than this (NICE-SLAM).
const REFINE_AFTER: usize = 4;
/// Stratified samples a ray when semantics are trained alone.
const SEMANTIC_STRATIFIED: u32 = 4;
/// Keyframes that every window holds while frames come in: the current one and the two before.
const RECENT: usize = 3;
/// How far anchors go at first when they settle, of the way to where their rays pull and push them.
const SETTLE_RATE: f64 = 0.2;

/// A part of the last optimisation.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    /// The whole map.
    All,
    /// The semantics alone.
    Semantics,
    /// The anchors alone.
    Anchors,
}

/// One call of the optimisation.
#[derive(Clone, Copy)]
struct Pass {
    iterations: u32,
    rates: Rates,
    /// Keyframes that every window holds, counted from the last.
    recent: usize,
    /// Training steps of the fusion, spread over the iterations.
    fusion_steps: u32,
    /// Train the semantics alone; the rest of the map stays as it is.
    semantic: bool,
}

/// By how much the kept depth images are smaller.
pub(super) fn observation_step(width: u32) -> u32 {
    width.div_ceil(OBSERVATION_WIDTH).max(1)
}

/// Box of world points without the outermost 0.2 % on each side.
fn robust_box(points: &[DVec3]) -> Option<Bounds> {
    if points.is_empty() {
        return None;
    }
    let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
    let cut = points.len() / 500;
    for k in 0..3 {
        let mut v: Vec<f64> = points.iter().map(|p| p[k]).collect();
        v.sort_by(f64::total_cmp);
        min[k] = v[cut];
        max[k] = v[v.len() - 1 - cut];
    }
    Some(Bounds { min, max })
}

impl Slam {
    /// Maps the frame tracked last. Returns the losses of the last iteration, and whether the
    /// frame became a keyframe.
    pub(super) async fn map(
        &mut self,
        frame: &Frame,
        reference: bool,
    ) -> Result<(Losses, bool), SlamError> {
        let Some(pose) = self.frames.last().map(|f| f.world_from_camera) else {
            return Err(SlamError::NoMap);
        };
        let (camera, unit) = (self.info.camera, self.info.depth_unit_m);
        let seen = sample_points(frame, &camera, unit, 20_000, self.config.seed);
        let world: Vec<DVec3> = seen
            .iter()
            .map(|p| pose.transform_point(DVec3::new(p[0].into(), p[1].into(), p[2].into())))
            .collect();
        self.fit_bounds(&world, pose.translation).await?;
        let Some(slot) = self.take_slot() else {
            return Err(SlamError::Frame {
                frame: frame.index,
                field: "keyframes",
                found: "no storage for another frame".into(),
                expected: "a larger keyframes.budget_mib".into(),
            });
        };
        self.class_counts.add(self.info.classes.len(), frame);
        let (engine, map, _) = self.mapped()?;
        let mut r = Recording::default();
        map.frames.upload_frame(&mut r, slot, frame);
        engine.submit(&r)?;

        let first = self.keyframes.is_empty();
        let since = self.keyframes.last().map_or(0, |k| frame.index - k.frame);
        let keyframe = first || reference || since >= self.config.keyframes.every as usize;
        self.keyframes.push(Keyframe { frame: frame.index, slot, world_from_camera: pose });
        let step = observation_step(camera.width) as usize;
        let (w, h) = (camera.width as usize, camera.height as usize);
        let depth = (0..h / step)
            .flat_map(|v| (0..w / step).map(move |u| (u, v)))
            .map(|(u, v)| frame.depth[(v * step + (step - 1) / 2) * w + u * step + (step - 1) / 2])
            .collect();
        self.observations.push(Observation { frame: frame.index, depth });

        let m = &self.config.mapping;
        let (iterations, factor) =
            if first { (m.first_iterations, m.first_rate_factor) } else { (m.iterations, 1.0) };
        let near: Vec<usize> = (0..self.keyframes.len() - 1)
            .filter(|&i| {
                let k = &self.keyframes[i];
                overlap(&world, &camera, &k.world_from_camera) > 0.05
            })
            .collect();
        let rates = Rates { planes: m.rate_planes * factor, decoders: m.rate_decoders * factor };
        let f = &self.config.fusion;
        let steps = if first { f.first_steps } else { f.steps };
        let losses = self
            .optimise(
                &near,
                Pass { iterations, rates, recent: RECENT, fusion_steps: steps, semantic: false },
            )
            .await?;
        self.mapping_calls += 1;
        if !keyframe && let Some(k) = self.keyframes.pop() {
            self.free_slots.push(k.slot);
        }
        Ok((losses, keyframe))
    }

    /// Goes over all keyframes once more, with falling rates: [`Slam::finish_step`] to its end.
    ///
    /// # Errors
    /// Engine failures. Nothing happens without keyframes.
    pub async fn finish(&mut self) -> Result<(), SlamError> {
        while self.finish_step().await? {}
        Ok(())
    }

    /// Iterations of [`Slam::finish`] that are done.
    pub fn finished_iterations(&self) -> u32 {
        self.finished_iterations
    }

    /// A part of [`Slam::finish`], after which a checkpoint can be made. Whether more is to be
    /// done. Once all is done further calls do nothing, until another frame has been processed.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn finish_step(&mut self) -> Result<bool, SlamError> {
        let mut done = self.finished_iterations;
        let mut current = None;
        for (part, total) in self.finish_parts() {
            if done < total {
                current = Some((part, total));
                break;
            }
            done -= total;
        }
        let Some((part, total)) = current.filter(|_| !self.keyframes.is_empty()) else {
            return Ok(false);
        };
        if self.finished_iterations == 0 {
            self.follow_odometer();
        }
        if part == Part::Semantics && done == 0 {
            self.refresh_targets()?;
        }
        let iterations = (total - done).min(FINISH_ITERATIONS);
        let left = f64::from(total - done) / f64::from(total);
        if part == Part::Anchors {
            self.settle_anchors(iterations, left, done == 0).await?;
        } else {
            let (m, f) = (&self.config.mapping, &self.config.fusion);
            let semantic = part == Part::Semantics;
            let factor = 0.1 + 0.9 * left;
            let rates =
                Rates { planes: m.rate_planes * factor, decoders: m.rate_decoders * factor };
            let fusion_steps = if semantic {
                steps_due(f.final_steps, total, done, iterations)
            } else {
                f.steps * iterations / m.iterations.max(1)
            };
            let all: Vec<usize> = (0..self.keyframes.len()).collect();
            let pass = Pass { iterations, rates, recent: 0, fusion_steps, semantic };
            self.optimise(&all, pass).await?;
        }
        self.finished_iterations += iterations;
        let more = self.finished_iterations < self.finish_iterations();
        if !more {
            self.follow_odometer();
        }
        Ok(more)
    }

    /// Iterations of [`Slam::finish`].
    pub(super) fn finish_iterations(&self) -> u32 {
        self.finish_parts().iter().fold(0, |sum, (_, total)| sum.saturating_add(*total))
    }

    /// The parts of the last optimisation, with their iterations.
    fn finish_parts(&self) -> [(Part, u32); 3] {
        let (m, s) = (&self.config.mapping, &self.config.suppressor);
        let semantic = if self.info.classes.is_empty() { 0 } else { m.semantic_iterations };
        let share = if self.has_anchors() { s.settle_share } else { 0.0 };
        let settling = (f64::from(semantic) * share + 0.5) as u32;
        [(Part::All, m.final_iterations), (Part::Semantics, semantic), (Part::Anchors, settling)]
    }

    /// Lets the anchors settle by what the head says of rays over all keyframes. `left` is the share
    /// of the part that is still to be done, `first` whether that is all.
    async fn settle_anchors(
        &mut self,
        iterations: u32,
        left: f64,
        first: bool,
    ) -> Result<(), SlamError> {
        let (m, s) = (self.config.mapping.clone(), self.config.sampling.clone());
        let loss = self.config.loss.clone();
        let (seed, breathe) = (self.config.seed, self.breathe);
        let keyframes: Vec<_> =
            self.keyframes.iter().map(|k| (k.slot, k.world_from_camera)).collect();
        let last_frame = self.keyframes.last().map_or(0, |k| k.frame);
        let window_size = (m.window as usize).min(WINDOW_MAX).min(keyframes.len());
        let first_iteration = self.iteration;
        self.iteration += iterations;
        let (engine, map, scratch) = self.mapped()?;
        let mut r = Recording::default();
        for (slot, pose) in &keyframes {
            map.frames.upload_pose(&mut r, *slot, pose);
        }
        for i in 0..iterations {
            let iteration = first_iteration + i;
            let all = (0..keyframes.len()).collect();
            let chosen = draw_window(BTreeSet::new(), all, window_size, seed, iteration);
            let window: Vec<(u32, bool)> = chosen.iter().map(|&k| (keyframes[k].0, true)).collect();
            scratch.upload_window(&mut r, &window);
            let frames = window.len() as u32;
            let batch = Batch {
                frames,
                rays_per_frame: m.rays / frames,
                // As views are rendered, without guidance: what silhouettes blend is to be told, too.
                stratified: (s.render_stratified / 4).max(1),
                surface: (s.render_surface / 2).max(1),
                flags: 0,
                loss: &loss,
                iteration,
                first: 0,
                camera: None,
                rare_share: s.rare_share,
                supervision: SemanticSupervision::default(),
            };
            passes::record_forward(&mut r, map, scratch, &batch);
            let (rate, begin) = (SETTLE_RATE * left, first && i == 0);
            suppressor::record_settling(&mut r, map, scratch, &batch, rate, begin);
            submit_when_due(engine, &mut r, i + 1, iterations, breathe).await?;
        }
        let counts = suppressor::read_counts(engine, map).await?;
        self.anchor_history.extend(counts.map(|c| (last_frame, c)));
        Ok(())
    }

    /// Fused features of every keyframe by what the fusion has learned since.
    fn refresh_targets(&mut self) -> Result<(), SlamError> {
        let keyframes: Vec<_> =
            self.keyframes.iter().map(|k| (k.slot, k.world_from_camera)).collect();
        let (engine, map, scratch) = self.mapped()?;
        for some in keyframes.chunks(ITERATIONS_PER_RECORDING as usize) {
            let mut r = Recording::default();
            for (slot, pose) in some {
                map.frames.upload_pose(&mut r, *slot, pose);
                fusion::record_forward(&mut r, map, scratch, *slot);
            }
            engine.submit(&r)?;
        }
        Ok(())
    }

    /// Makes the map, or grows it, so that it holds the points and the camera.
    async fn fit_bounds(&mut self, world: &[DVec3], camera: DVec3) -> Result<(), SlamError> {
        let margin = DVec3::splat(self.config.field.margin_m);
        let given = self.info.bounds.filter(|_| self.config.field.use_given_bounds);
        if self.map.is_none() {
            let bounds = match given {
                Some(b) => b,
                None => {
                    let b = robust_box(world).unwrap_or(Bounds { min: camera, max: camera });
                    Bounds { min: b.min.min(camera) - margin, max: b.max.max(camera) + margin }
                }
            };
            let shape = FieldShape::new(bounds, &self.config.field);
            let format = FrameFormat::from(&self.info);
            let map = Map::new(&mut self.engine, &self.config, &format, shape)?;
            self.scratch = Some(Scratch::new(&mut self.engine, &self.config, &map)?);
            self.free_slots = (1..map.slots()).rev().collect();
            self.map = Some(map);
            return Ok(());
        }
        if given.is_some() || self.bounds_refused {
            return Ok(());
        }
        let Some(b) = robust_box(world) else { return Ok(()) };
        let held = Bounds { min: b.min.min(camera), max: b.max.max(camera) };
        let (config, seed) = (self.config.field.clone(), self.config.seed);
        let (engine, map, _) = self.mapped()?;
        if map.shape.grown(held, &config).is_none() {
            return Ok(());
        }
        // Grow with the margin, so that the next frames fit as well.
        let wanted = Bounds { min: held.min - margin, max: held.max + margin };
        if let Some(shape) = map.shape.grown(wanted, &config) {
            if shape.surface_floats().max(shape.geometry_floats()) > engine.max_buffer_words() {
                // The map stays as it is; surfaces outside it are ignored.
                self.bounds_refused = true;
                return Ok(());
            }
            map.grow(engine, shape, seed).await?;
        }
        Ok(())
    }

    /// Whether the map stopped growing because it would pass the device's limits.
    pub fn bounds_refused(&self) -> bool {
        self.bounds_refused
    }

    /// Optimises map and poses over windows of the `recent` last keyframes (the current frame
    /// among them) and others drawn from the keyframes `near`.
    async fn optimise(&mut self, near: &[usize], pass: Pass) -> Result<Losses, SlamError> {
        let Pass { iterations, rates, recent, fusion_steps, semantic } = pass;
        let breathe = self.breathe;
        let m = self.config.mapping.clone();
        let s = self.config.sampling.clone();
        let mut loss = self.config.loss.clone();
        if semantic {
            loss.color = 0.0;
        }
        let seed = self.config.seed;
        let n = self.keyframes.len();
        let refine = !semantic
            && n > REFINE_AFTER
            && match (m.refine_poses, self.config.tracking.tracker) {
                (_, Tracker::Truth) | (RefinePoses::Off, _) => false,
                (RefinePoses::On, _) => true,
                (RefinePoses::Auto, tracker) => tracker == Tracker::Render,
            };
        let window_size = (m.window as usize).min(WINDOW_MAX).min(n);
        let keyframes: Vec<(u32, _)> =
            self.keyframes.iter().map(|k| (k.slot, k.world_from_camera)).collect();
        let first_iteration = self.iteration;
        self.iteration += iterations;
        let last_frame = self.keyframes.last().map_or(0, |k| k.frame);
        let (fusion, suppressor) = (&self.config.fusion, &self.config.suppressor);
        let rare_share = if semantic { s.semantic_rare_share } else { s.rare_share };
        let ray_weights = self.class_counts.ray_weights(&loss, rare_share, s.rare_draws);
        let token_weights = self.class_counts.weights(fusion.balance);
        let rarity = self.class_counts.rarity();
        let supervision = if semantic {
            SemanticSupervision {
                compression: suppressor.final_weight,
                feature: fusion.final_weight,
                doubt_anchor: suppressor.doubt,
                doubt_fused: fusion.doubt,
            }
        } else {
            SemanticSupervision {
                compression: self.compression(suppressor),
                feature: self.feature(fusion),
                ..SemanticSupervision::default()
            }
        };
        let (engine, map, scratch) = self.mapped()?;
        let mut touched = BTreeSet::new();
        let mut r = Recording::default();
        map.upload_class_weights(&mut r, &ray_weights, &token_weights, &rarity);
        for (slot, pose) in &keyframes {
            map.frames.upload_pose(&mut r, *slot, pose);
        }
        let mut rays = 0;
        for i in 0..iterations {
            let iteration = first_iteration + i;
            let held: BTreeSet<usize> = (n.saturating_sub(recent)..n).collect();
            let others = near.iter().copied().filter(|k| !held.contains(k)).collect();
            let chosen = draw_window(held, others, window_size, seed, iteration);
            let oldest = chosen.first().copied();
            let window: Vec<(u32, bool)> = chosen
                .iter()
                .map(|&k| (keyframes[k].0, !refine || k == 0 || Some(k) == oldest))
                .collect();
            for step in 0..steps_due(fusion_steps, iterations, i, 1) {
                // Every other step goes over an earlier frame: the fusion must not forget.
                let k = if map.fusion_steps().is_multiple_of(2) && recent > 0 {
                    n - 1
                } else {
                    let at = random_u32(seed, iteration, step, 22) as usize % chosen.len();
                    chosen.iter().nth(at).copied().unwrap_or(n - 1)
                };
                fusion::record_step(&mut r, map, scratch, keyframes[k].0, rates.decoders);
            }
            touched.extend(chosen);
            scratch.upload_window(&mut r, &window);
            let frames = window.len() as u32;
            let batch = Batch {
                frames,
                rays_per_frame: m.rays / frames,
                // Semantics sit on the surface: the samples around it carry them.
                stratified: if semantic { SEMANTIC_STRATIFIED } else { s.stratified },
                surface: s.surface,
                flags: FLAG_GUIDED | FLAG_MAP | if refine { FLAG_POSE } else { 0 },
                loss: &loss,
                iteration,
                first: 0,
                camera: None,
                rare_share,
                supervision,
            };
            rays = batch.frames * batch.rays_per_frame;
            passes::record_forward(&mut r, map, scratch, &batch);
            suppressor::record_update(&mut r, map, scratch, &batch);
            if i + 1 == iterations {
                suppressor::record_maintenance(&mut r, map, scratch, &batch);
            }
            if semantic {
                passes::record_semantic_backward(&mut r, map, scratch, &batch);
                passes::record_semantic_step(&mut r, map, scratch, &batch, rates);
            } else {
                passes::record_backward(&mut r, map, scratch, &batch);
                if refine {
                    let (v, w) = (m.rate_translation_m, m.rate_rotation_rad);
                    passes::record_pose_step(&mut r, map, scratch, &batch, v, w, false);
                }
                passes::record_step(&mut r, map, scratch, &batch, rates);
            }
            submit_when_due(engine, &mut r, i + 1, iterations, breathe).await?;
        }
        let losses = read_losses(engine, scratch, rays, &loss).await?;
        if map.read_status(engine).await? & crate::kernels::adam::STATUS_NOT_FINITE != 0 {
            return Err(SlamError::NotFinite { frame: last_frame });
        }
        let counts = suppressor::read_counts(engine, map).await?;
        if refine {
            let poses = map.frames.read_poses(engine, map.slots()).await?;
            for k in touched {
                let slot = keyframes[k].0 as usize;
                if let Some(Some(pose)) = poses.get(slot) {
                    self.keyframes[k].world_from_camera = *pose;
                    self.odometer.set_frame_pose(self.keyframes[k].frame, *pose);
                }
            }
        }
        self.anchor_history.extend(counts.map(|c| (last_frame, c)));
        Ok(losses)
    }
}

/// Submits what is recorded once it is enough, or all there is, and starts anew.
async fn submit_when_due(
    engine: &mut Engine,
    r: &mut Recording,
    done: u32,
    iterations: u32,
    breathe: Option<Breathe>,
) -> Result<(), SlamError> {
    if !done.is_multiple_of(ITERATIONS_PER_RECORDING) && done != iterations {
        return Ok(());
    }
    engine.submit(&core::mem::take(r))?;
    if let Some(breathe) = breathe {
        engine.synchronise().await?;
        breathe(done, iterations).await;
    }
    Ok(())
}

/// A window of at most `size` keyframes: the newest of those it must hold, and others drawn.
fn draw_window(
    mut window: BTreeSet<usize>,
    mut others: Vec<usize>,
    size: usize,
    seed: u32,
    iteration: u32,
) -> BTreeSet<usize> {
    let mut draw = 0;
    while window.len() < size && !others.is_empty() {
        let k = random_u32(seed, iteration, draw, 21) as usize % others.len();
        window.insert(others.swap_remove(k));
        draw += 1;
    }
    while window.len() > size {
        window.pop_first();
    }
    window
}

/// Weighted mean losses of the last batch.
async fn read_losses(
    engine: &mut Engine,
    scratch: &Scratch,
    rays: u32,
    loss: &crate::config::LossConfig,
) -> Result<Losses, SlamError> {
    let out = scratch.read_ray_out(engine, rays).await?;
    let mut l = Losses::default();
    let inv = 1.0 / f64::from(rays.max(1));
    for ray in out.chunks_exact(RAY_OUT_FLOATS) {
        l.color += f64::from(ray[6]) * loss.color * inv;
        l.depth += f64::from(ray[7]) * loss.depth * inv;
        l.semantic += f64::from(ray[8]) * loss.semantic * inv;
        l.sdf += f64::from(ray[9]) * inv;
    }
    l.total = l.color + l.depth + l.semantic + l.sdf;
    Ok(l)
}
