//! Plans of the optimisation: what each of its iterations does, computed from configuration,
//! counters and keyframes alone. [`super::mapping`] records them.
use super::keyframes::MapKeyframe;
use crate::{
    config::{Config, FusionConfig, LossConfig, RefinePoses, SuppressorConfig, Tracker},
    kernels::shared::{FLAG_GUIDED, FLAG_MAP, FLAG_POSE, random_u32},
    map::{Batch, Rates, SemanticSupervision, WINDOW_MAX},
};
use alloc::{collections::BTreeSet, vec::Vec};
use mte_slam_shaders::random::salt;

/// Keyframes that every window holds while frames come in: the current one and the two before.
const RECENT: usize = 3;
/// Joint pose refinement needs more keyframes than this (NICE-SLAM).
const REFINE_AFTER: usize = 4;
/// Stratified samples per ray when semantics are trained alone: they sit on the surface, and the
/// samples around it carry them.
const SEMANTIC_STRATIFIED: u32 = 4;
/// How far anchors go at first when they settle, of the way to where their rays pull and push them.
const SETTLE_RATE: f64 = 0.2;
/// Most iterations of one call in the last optimisation.
const FINISH_ITERATIONS: u32 = 20;

/// What an optimisation trains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// The whole map.
    Map,
    /// The semantics alone; the rest of the map stays as it is.
    Semantics,
    /// The anchors alone.
    Anchors,
}

/// What a plan depends on beside the configuration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Progress<'a> {
    /// Keyframes whose images are stored; the last one is the current frame's.
    pub keyframes: &'a [MapKeyframe],
    /// Iterations so far.
    pub iteration: u32,
    /// Calls of the optimisation while frames came in.
    pub mapping_calls: u32,
    /// Training steps of the fusion so far.
    pub fusion_steps: u32,
}

/// One call of the optimisation.
#[derive(Clone, Debug)]
pub(super) struct OptimisationPlan {
    pub stage: Stage,
    pub iterations: u32,
    pub rates: Rates,
    /// Move the window's poses, too.
    pub refine_poses: bool,
    pub loss: LossConfig,
    /// Share of the rays that seek rare classes.
    pub rare_share: f64,
    /// Of [`Stage::Anchors`]: how far anchors go.
    pub settle_rate: f64,
    /// Of [`Stage::Anchors`]: whether they begin to settle with this call.
    settling_begins: bool,
    supervision: SemanticSupervision,
    seed: u32,
    first_iteration: u32,
    /// Slots of the keyframes.
    slots: Vec<u32>,
    /// Keyframes from here on are in every window.
    held_from: usize,
    /// The others to draw from.
    drawn_from: Vec<usize>,
    window_size: usize,
    /// Rays of all frames of a window.
    rays: u32,
    stratified: u32,
    surface: u32,
    flags: u32,
    /// Training steps of the fusion, spread over the iterations, and how many came before.
    fusion_steps: u32,
    fusion_steps_before: u32,
}

/// One iteration.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct IterationPlan {
    /// Counter of the random numbers.
    pub iteration: u32,
    /// The window's keyframes, ascending.
    pub keyframes: Vec<usize>,
    /// Their slots, and whether each pose is fixed.
    pub window: Vec<(u32, bool)>,
    /// Slots of the frames that the fusion is trained on first.
    pub fusion: Vec<u32>,
    /// Rays per frame of the window.
    pub rays_per_frame: u32,
    /// Whether anchors are dropped, merged and spawned: in the last iteration.
    pub maintain_anchors: bool,
    /// Whether anchors begin to settle.
    pub begin_settling: bool,
}

impl OptimisationPlan {
    /// For a frame that has just been stored: over it, the frames before it and keyframes out of
    /// `near`, which overlap with it.
    pub fn for_frame(config: &Config, progress: &Progress<'_>, near: Vec<usize>) -> Self {
        let (m, f) = (&config.mapping, &config.fusion);
        let first = progress.keyframes.len() == 1;
        let (iterations, factor) =
            if first { (m.first_iterations, m.first_rate_factor) } else { (m.iterations, 1.0) };
        let n = progress.keyframes.len();
        OptimisationPlan {
            iterations,
            rates: rates(config, factor),
            held_from: n.saturating_sub(RECENT),
            drawn_from: near,
            fusion_steps: if first { f.first_steps } else { f.steps },
            supervision: SemanticSupervision {
                compression: compression_weight(&config.suppressor, progress.mapping_calls),
                feature: feature_weight(f, progress.mapping_calls),
                ..SemanticSupervision::default()
            },
            ..Self::over_all(config, progress, Stage::Map)
        }
    }

    /// For iterations of the last optimisation, over all keyframes.
    pub fn for_finish(config: &Config, progress: &Progress<'_>, part: &FinishPart) -> Self {
        let (m, f, s) = (&config.mapping, &config.fusion, &config.suppressor);
        let (iterations, left) = (part.iterations, part.left());
        let rates = rates(config, 0.1 + 0.9 * left);
        let plan = Self::over_all(config, progress, part.stage);
        match part.stage {
            Stage::Map => OptimisationPlan {
                iterations,
                rates,
                fusion_steps: f.steps * iterations / m.iterations.max(1),
                supervision: SemanticSupervision {
                    compression: compression_weight(s, progress.mapping_calls),
                    feature: feature_weight(f, progress.mapping_calls),
                    ..SemanticSupervision::default()
                },
                ..plan
            },
            Stage::Semantics => OptimisationPlan {
                iterations,
                rates,
                loss: LossConfig { color: 0.0, ..config.loss.clone() },
                rare_share: config.sampling.semantic_rare_share,
                stratified: SEMANTIC_STRATIFIED,
                fusion_steps: steps_due(f.final_steps, part.total, part.done, iterations),
                supervision: SemanticSupervision {
                    compression: s.final_weight,
                    feature: f.final_weight,
                    doubt_anchor: s.doubt,
                    doubt_fused: f.doubt,
                },
                ..plan
            },
            // As views are rendered, without a sensor's depth: anchors must also give the classes
            // that silhouettes blend.
            Stage::Anchors => OptimisationPlan {
                iterations,
                rates,
                settle_rate: SETTLE_RATE * left,
                settling_begins: part.done == 0,
                stratified: (config.sampling.render_stratified / 4).max(1),
                surface: (config.sampling.render_surface / 2).max(1),
                flags: 0,
                ..plan
            },
        }
    }

    /// No iterations yet, over all keyframes.
    fn over_all(config: &Config, progress: &Progress<'_>, stage: Stage) -> Self {
        let n = progress.keyframes.len();
        let refine_poses = stage == Stage::Map && refines_poses(config, n);
        OptimisationPlan {
            stage,
            iterations: 0,
            rates: rates(config, 1.0),
            refine_poses,
            loss: config.loss.clone(),
            rare_share: config.sampling.rare_share,
            settle_rate: 0.0,
            settling_begins: false,
            supervision: SemanticSupervision::default(),
            seed: config.seed,
            first_iteration: progress.iteration,
            slots: progress.keyframes.iter().map(|k| k.slot).collect(),
            held_from: n,
            drawn_from: (0..n).collect(),
            window_size: (config.mapping.window as usize).min(WINDOW_MAX).min(n),
            rays: config.mapping.rays,
            stratified: config.sampling.stratified,
            surface: config.sampling.surface,
            flags: FLAG_GUIDED | FLAG_MAP | if refine_poses { FLAG_POSE } else { 0 },
            fusion_steps: 0,
            fusion_steps_before: progress.fusion_steps,
        }
    }

    /// Iteration `i` of the call.
    pub fn iteration(&self, i: u32) -> IterationPlan {
        let n = self.slots.len();
        let iteration = self.first_iteration + i;
        let held: BTreeSet<usize> = (self.held_from..n).collect();
        let others = self.drawn_from.iter().copied().filter(|k| !held.contains(k)).collect();
        let chosen = draw_window(held, others, self.window_size, self.seed, iteration);
        let oldest = chosen.first().copied();
        let fixed = |k: usize| !self.refine_poses || k == 0 || Some(k) == oldest;
        IterationPlan {
            iteration,
            window: chosen.iter().map(|&k| (self.slots[k], fixed(k))).collect(),
            fusion: self.fusion_slots(i, &chosen),
            rays_per_frame: self.rays / chosen.len().max(1) as u32,
            maintain_anchors: i + 1 == self.iterations,
            begin_settling: self.settling_begins && i == 0,
            keyframes: chosen.into_iter().collect(),
        }
    }

    /// Slots of the frames that the fusion is trained on in iteration `i`.
    fn fusion_slots(&self, i: u32, chosen: &BTreeSet<usize>) -> Vec<u32> {
        let n = self.slots.len();
        let before = self.fusion_steps_before + steps_due(self.fusion_steps, self.iterations, 0, i);
        let due = steps_due(self.fusion_steps, self.iterations, i, 1);
        let frame = |step: u32| {
            // Every other step goes over an earlier frame: the fusion must not forget.
            if (before + step).is_multiple_of(2) && self.held_from < n {
                return n - 1;
            }
            let iteration = self.first_iteration + i;
            let at = random_u32(self.seed, iteration, step, salt::SEMANTIC_KEYFRAME) as usize;
            let at = at % chosen.len().max(1);
            chosen.iter().nth(at).copied().unwrap_or(n - 1)
        };
        (0..due).map(|step| self.slots[frame(step)]).collect()
    }

    /// The batch of rays of one iteration.
    pub fn batch(&self, iteration: &IterationPlan) -> Batch<'_> {
        Batch {
            frames: iteration.window.len() as u32,
            rays_per_frame: iteration.rays_per_frame,
            stratified: self.stratified,
            surface: self.surface,
            flags: self.flags,
            loss: &self.loss,
            iteration: iteration.iteration,
            first: 0,
            camera: None,
            rare_share: self.rare_share,
            supervision: self.supervision,
        }
    }
}

fn rates(config: &Config, factor: f64) -> Rates {
    let m = &config.mapping;
    Rates { planes: m.rate_planes * factor, decoders: m.rate_decoders * factor }
}

/// Whether poses of `keyframes` keyframes are refined with the map.
fn refines_poses(config: &Config, keyframes: usize) -> bool {
    keyframes > REFINE_AFTER
        && match (config.mapping.refine_poses, config.tracking.tracker) {
            (_, Tracker::Truth) | (RefinePoses::Off, _) => false,
            (RefinePoses::On, _) => true,
            (RefinePoses::Auto, tracker) => tracker == Tracker::Render,
        }
}

/// Weight of the compression loss by stage: features must have settled before they are held.
fn compression_weight(c: &SuppressorConfig, mapping_calls: u32) -> f64 {
    let since = f64::from(mapping_calls) - f64::from(c.start);
    if since < 0.0 { 0.0 } else { c.weight * (since / f64::from(c.ramp.max(1))).min(1.0) }
}

/// Weight of the feature loss: the fusion must have been trained on one frame.
fn feature_weight(c: &FusionConfig, mapping_calls: u32) -> f64 {
    if mapping_calls == 0 { 0.0 } else { c.weight }
}

/// Training steps of the fusion that are due in `count` iterations from the `first` on, of `steps`
/// spread over `iterations`.
fn steps_due(steps: u32, iterations: u32, first: u32, count: u32) -> u32 {
    let until = |i: u32| u64::from(i) * u64::from(steps) / u64::from(iterations.max(1));
    (until(first + count) - until(first)) as u32
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
        let k = random_u32(seed, iteration, draw, salt::WINDOW_KEYFRAME) as usize % others.len();
        window.insert(others.swap_remove(k));
        draw += 1;
    }
    while window.len() > size {
        window.pop_first();
    }
    window
}

/// The stages of the last optimisation, with the iterations of each.
#[derive(Clone, Copy, Debug)]
pub(super) struct FinishPlan([(Stage, u32); 3]);

/// The iterations of the last optimisation that come next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FinishPart {
    pub stage: Stage,
    /// Iterations of the stage.
    pub total: u32,
    /// Those that are done.
    pub done: u32,
    /// Those that come next.
    pub iterations: u32,
}

impl FinishPlan {
    /// `classes`: there are any; `anchors`: the map has a suppressor.
    pub fn new(config: &Config, classes: bool, anchors: bool) -> FinishPlan {
        let (m, s) = (&config.mapping, &config.suppressor);
        let semantic = if classes { m.semantic_iterations } else { 0 };
        let share = if anchors { s.settle_share } else { 0.0 };
        let settling = (f64::from(semantic) * share + 0.5) as u32;
        FinishPlan([
            (Stage::Map, m.final_iterations),
            (Stage::Semantics, semantic),
            (Stage::Anchors, settling),
        ])
    }

    /// Iterations of all stages.
    pub fn iterations(&self) -> u32 {
        self.0.iter().fold(0, |sum, (_, total)| sum.saturating_add(*total))
    }

    /// What comes after `done` iterations; `None` when all is done.
    pub fn next(&self, mut done: u32) -> Option<FinishPart> {
        for (stage, total) in self.0 {
            if done < total {
                let iterations = (total - done).min(FINISH_ITERATIONS);
                return Some(FinishPart { stage, total, done, iterations });
            }
            done -= total;
        }
        None
    }
}

impl FinishPart {
    /// Share of the stage that is still to be done.
    fn left(&self) -> f64 {
        f64::from(self.total - self.done) / f64::from(self.total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use alloc::vec;

    fn keyframes(n: usize) -> Vec<MapKeyframe> {
        let keyframe = |i: usize| MapKeyframe {
            frame: 5 * i,
            slot: 100 + i as u32,
            world_from_camera: Pose::IDENTITY,
        };
        (0..n).map(keyframe).collect()
    }

    fn progress(keyframes: &[MapKeyframe]) -> Progress<'_> {
        Progress { keyframes, iteration: 40, mapping_calls: 3, fusion_steps: 7 }
    }

    fn config() -> Config {
        let mut c = Config::default();
        (c.mapping.window, c.mapping.iterations, c.mapping.rays) = (5, 10, 1003);
        (c.fusion.steps, c.mapping.refine_poses) = (4, RefinePoses::On);
        c
    }

    #[test]
    fn windows_hold_recent_frames_and_others_that_are_near() {
        let keyframes = keyframes(12);
        let plan = OptimisationPlan::for_frame(&config(), &progress(&keyframes), vec![0, 2, 3, 6]);
        let mut drawn = BTreeSet::new();
        for i in 0..plan.iterations {
            let iteration = plan.iteration(i);
            assert_eq!(iteration, plan.iteration(i));
            assert_eq!(iteration.iteration, 40 + i);
            let (others, recent) = iteration.keyframes.split_at(2);
            assert_eq!(recent, [9, 10, 11]);
            assert!(others.iter().all(|k| [0, 2, 3, 6].contains(k)), "{others:?}");
            drawn.extend(others.to_vec());
            for (place, (slot, fixed)) in iteration.window.iter().enumerate() {
                assert_eq!(*slot, 100 + iteration.keyframes[place] as u32);
                assert_eq!(*fixed, place == 0, "the oldest pose is fixed");
            }
            assert_eq!(iteration.rays_per_frame, 200);
            assert_eq!(iteration.maintain_anchors, i + 1 == plan.iterations);
            assert!(!iteration.begin_settling);
        }
        assert_eq!(drawn.len(), 4);
        // Fewer keyframes than a window takes.
        let few = &keyframes[..2];
        let plan = OptimisationPlan::for_frame(&config(), &progress(few), vec![0]);
        assert_eq!(plan.iteration(0).keyframes, [0, 1]);
        assert!(!plan.refine_poses);
    }

    #[test]
    fn fusion_steps_are_spread_and_every_other_one_is_of_the_newest_frame() {
        let keyframes = keyframes(9);
        let plan = OptimisationPlan::for_frame(&config(), &progress(&keyframes), vec![0, 1, 2]);
        let slots: Vec<Vec<u32>> = (0..plan.iterations).map(|i| plan.iteration(i).fusion).collect();
        assert!(slots.iter().all(|s| s.len() <= 1), "{slots:?}");
        let slots: Vec<u32> = slots.into_iter().flatten().collect();
        assert_eq!(slots.len(), 4);
        // Seven steps came before.
        assert_eq!((slots[1], slots[3]), (108, 108));
        // The first frame has more steps than iterations.
        let mut c = config();
        (c.mapping.first_iterations, c.fusion.first_steps) = (10, 25);
        let plan = OptimisationPlan::for_frame(&c, &progress(&keyframes[..1]), vec![]);
        let steps = (0..10).map(|i| plan.iteration(i).fusion.len()).sum::<usize>();
        assert_eq!((plan.iterations, steps), (10, 25));
        assert_eq!(plan.rates.planes, c.mapping.rate_planes * c.mapping.first_rate_factor);
    }

    #[test]
    fn the_last_optimisation_goes_through_its_stages_with_falling_rates() {
        let mut c = config();
        (c.mapping.final_iterations, c.mapping.semantic_iterations) = (50, 30);
        (c.suppressor.settle_share, c.fusion.final_steps) = (0.5, 11);
        let finish = FinishPlan::new(&c, true, true);
        assert_eq!(finish.iterations(), 50 + 30 + 15);
        let keyframes = keyframes(12);
        let (mut done, mut parts, mut fusion) = (0, Vec::new(), 0);
        let mut last = f64::INFINITY;
        while let Some(part) = finish.next(done) {
            let plan = OptimisationPlan::for_finish(&c, &progress(&keyframes), &part);
            if part.done == 0 {
                last = f64::INFINITY;
            }
            assert!(plan.rates.planes < last && plan.rates.planes > 0.1 * c.mapping.rate_planes);
            last = plan.rates.planes;
            let first = plan.iteration(0);
            match part.stage {
                Stage::Map => assert!(plan.refine_poses && plan.loss == c.loss),
                Stage::Semantics => {
                    assert!(!plan.refine_poses && plan.loss.color == 0.0);
                    assert_eq!(plan.supervision.feature, c.fusion.final_weight);
                    fusion +=
                        (0..plan.iterations).map(|i| plan.iteration(i).fusion.len()).sum::<usize>();
                }
                Stage::Anchors => {
                    assert_eq!((plan.flags, first.begin_settling), (0, part.done == 0));
                    assert!(first.fusion.is_empty() && first.window.iter().all(|(_, f)| *f));
                }
            }
            parts.push((part.stage, part.iterations));
            done += part.iterations;
        }
        use Stage::{Anchors, Map, Semantics};
        let expected =
            [(Map, 20), (Map, 20), (Map, 10), (Semantics, 20), (Semantics, 10), (Anchors, 15)];
        assert_eq!(parts, expected);
        assert_eq!(fusion, 11);
        let without = FinishPlan::new(&c, false, false);
        assert_eq!((without.iterations(), without.next(50)), (50, None));
    }

    #[test]
    fn the_compression_loss_rises_once_features_have_settled() {
        let c = SuppressorConfig { weight: 0.2, start: 2, ramp: 4, ..SuppressorConfig::default() };
        let weights = [0, 2, 3, 6, 60].map(|calls| compression_weight(&c, calls));
        assert_eq!(weights, [0.0, 0.0, 0.05, 0.2, 0.2]);
        let c = FusionConfig { weight: 0.3, ..FusionConfig::default() };
        assert_eq!([0, 1].map(|calls| feature_weight(&c, calls)), [0.0, 0.3]);
    }
}
