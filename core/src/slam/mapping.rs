//! Commands the plans of the optimisation.
use super::{
    Losses, Pace, Slam, SlamError,
    plan::{IterationPlan, OptimisationPlan, Progress, Stage},
};
use crate::{
    commands::Commands,
    config::LossConfig,
    engine::Engine,
    kernels::adam::STATUS_NOT_FINITE,
    layout::RAY_OUT_FLOATS,
    map::{Map, Scratch, fusion, passes, suppressor},
};
use alloc::collections::BTreeSet;

/// Iterations recorded and submitted at once: long enough to amortise, short enough for watchdogs.
pub(super) const ITERATIONS_PER_SUBMISSION: u32 = 4;

impl Slam {
    /// What plans depend on beside the configuration.
    pub(super) fn progress(&self) -> Progress<'_> {
        Progress {
            keyframes: &self.keyframes,
            iteration: self.iteration,
            mapping_calls: self.mapping_calls,
            fusion_steps: self.map.as_ref().map_or(0, Map::fusion_steps),
        }
    }

    /// Carries a plan out: map, anchors and poses move. Returns the losses of the last iteration,
    /// zeros where only anchors are trained.
    pub(super) async fn optimise(
        &mut self,
        plan: &OptimisationPlan,
        pace: &mut dyn Pace,
    ) -> Result<Losses, SlamError> {
        self.iteration += plan.iterations;
        let last_frame = self.keyframes.last().map_or(0, |k| k.frame);
        let (Some(map), Some(scratch)) = (&mut self.map, &self.scratch) else {
            return Err(SlamError::NoMap);
        };
        let engine = &mut self.engine;
        let mut r = Commands::default();
        if plan.stage != Stage::Anchors {
            let draws = self.config.sampling.rare_draws;
            let counts = &self.class_counts;
            let rays = counts.ray_weights(&plan.loss, plan.rare_share, draws);
            let tokens = counts.weights(self.config.fusion.balance);
            map.upload_class_weights(&mut r, &rays, &tokens, &counts.rarity());
        }
        for k in &self.keyframes {
            map.frames.upload_pose(&mut r, k.slot, &k.world_from_camera);
        }
        let (translation_m, rotation_rad) =
            (self.config.mapping.rate_translation_m, self.config.mapping.rate_rotation_rad);
        let mut rays = 0;
        let mut visited = BTreeSet::new();
        for i in 0..plan.iterations {
            let iteration = plan.iteration(i);
            let pose_rates = plan.refine_poses.then_some([translation_m, rotation_rad]);
            record_iteration(&mut r, map, scratch, plan, &iteration, pose_rates);
            rays = plan.batch(&iteration).rays();
            visited.extend(iteration.keyframes);
            let done = i + 1;
            if done.is_multiple_of(ITERATIONS_PER_SUBMISSION) || done == plan.iterations {
                engine.submit(&core::mem::take(&mut r))?;
                if pace.has_event_loop() {
                    engine.synchronise().await?;
                    pace.turn(done, plan.iterations).await;
                }
            }
        }
        let mut losses = Losses::default();
        if plan.stage != Stage::Anchors {
            losses = read_losses(engine, scratch, rays, &plan.loss).await?;
            if map.read_status(engine).await? & STATUS_NOT_FINITE != 0 {
                return Err(SlamError::NotFinite { frame: last_frame });
            }
        }
        let counts = suppressor::read_counts(engine, map).await?;
        if plan.refine_poses {
            let poses = map.frames.read_poses(engine, map.slots()).await?;
            for k in visited {
                let keyframe = &mut self.keyframes[k];
                if let Some(Some(pose)) = poses.get(keyframe.slot as usize) {
                    keyframe.world_from_camera = *pose;
                    self.odometer.set_frame_pose(keyframe.frame, *pose);
                }
            }
        }
        self.anchor_history.extend(counts.map(|c| (last_frame, c)));
        Ok(losses)
    }
}

/// One iteration, as the paper's figure 2 has it.
fn record_iteration(
    r: &mut Commands,
    map: &mut Map,
    scratch: &Scratch,
    plan: &OptimisationPlan,
    iteration: &IterationPlan,
    pose_rates: Option<[f64; 2]>,
) {
    // Multi-tier feature fusion: features of stored frames, which supervise the rays.
    for slot in &iteration.fusion {
        fusion::record_step(r, map, scratch, *slot, plan.rates.decoders);
    }
    // Rays of the window, samples along them, their features decoded to colour, depth and classes;
    // and what these lose against the images, the fused features and the anchors.
    let batch = plan.batch(iteration);
    scratch.upload_window(r, &iteration.window);
    passes::record_forward(r, map, scratch, &batch);
    // Feature redundancy suppressor: the anchors follow the rays' features.
    if plan.stage == Stage::Anchors {
        let (rate, begin) = (plan.settle_rate, iteration.begin_settling);
        suppressor::record_settling(r, map, scratch, &batch, rate, begin);
        return;
    }
    suppressor::record_update(r, map, scratch, &batch);
    if iteration.maintain_anchors {
        suppressor::record_maintenance(r, map, scratch, &batch);
    }
    // Joint optimisation of map and poses.
    if plan.stage == Stage::Semantics {
        passes::record_semantic_backward(r, map, scratch, &batch);
        passes::record_semantic_step(r, map, scratch, &batch, plan.rates);
        return;
    }
    passes::record_backward(r, map, scratch, &batch);
    if let Some([translation_m, rotation_rad]) = pose_rates {
        passes::record_pose_step(r, map, scratch, &batch, translation_m, rotation_rad, false);
    }
    passes::record_step(r, map, scratch, &batch, plan.rates);
}

/// Weighted mean losses of the last batch.
async fn read_losses(
    engine: &mut Engine,
    scratch: &Scratch,
    rays: u32,
    loss: &LossConfig,
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
