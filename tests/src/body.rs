//! The bodies of the consistency tests, which run natively and in a browser.
use crate::{
    Tolerance,
    case::Case,
    compare_outputs,
    fixture::{POISON, run_words_async},
};
use mte_slam_core::{
    config::{Config, Tracker},
    engine::{Engine, EngineError},
    slam::SlamError,
};
use mte_slam_run::{Run, RunError};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{pose::Pose, sequence::Sequence};

/// All buffers after a case.
pub type Outcome = Vec<Vec<u32>>;

/// Runs a case and returns all buffers afterwards.
///
/// # Errors
/// The engine's.
pub async fn run_case(engine: &mut Engine, case: &Case) -> Result<Outcome, EngineError> {
    run_words_async(engine, case.kernel, &case.params, &case.buffers, case.workgroups).await
}

/// An engine on all cases of a kernel against the expected buffers; then again from another
/// garbage in the buffers that the kernel overwrites, which must change nothing.
///
/// # Errors
/// The first difference, for people.
pub async fn check_cases(
    engine: &mut Engine,
    cases: &[Case],
    expected: &[Outcome],
) -> Result<(), String> {
    if cases.is_empty() || cases.len() != expected.len() {
        return Err(format!("{} cases, {} expected results", cases.len(), expected.len()));
    }
    for (case, expected) in cases.iter().zip(expected) {
        let name = (case.kernel.interface.name, case.name);
        let failed = |e: EngineError| format!("{name:?}: {e}");
        let found = run_case(engine, case).await.map_err(failed)?;
        compare_outputs(case.kernel, expected, &found, &Tolerance(case.tolerance.clone()))
            .map_err(|e| format!("{name:?}: {e:?}"))?;
        if case.overwritten.is_empty() {
            continue;
        }
        let mut dirty = case.buffers.clone();
        for (binding, words) in case.kernel.interface.bindings.iter().zip(&mut dirty) {
            if case.overwritten.contains(&binding.name) {
                words.iter_mut().enumerate().for_each(|(i, w)| *w = 0x4b1d_0000 ^ i as u32);
            }
        }
        let again = run_words_async(engine, case.kernel, &case.params, &dirty, case.workgroups)
            .await
            .map_err(failed)?;
        for (i, binding) in case.kernel.interface.bindings.iter().enumerate() {
            if again[i] != found[i] {
                return Err(format!("{name:?}: {} depends on what was there", binding.name));
            }
            if case.overwritten.contains(&binding.name) && found[i].contains(&POISON) {
                return Err(format!("{name:?}: {} is not fully written", binding.name));
            }
        }
    }
    Ok(())
}

/// How far a frame's position on a GPU may be off from the CPU engine's \[m\]. They round
/// differently, and the optimiser's steps of 2 mm carry that on: gaps of 0.5 to 6 mm were seen, by
/// seed and configuration. A pixel of the short run is 5 cm wide at the far wall. CPU engines
/// agree bit for bit everywhere.
pub const TRAJECTORY_TOLERANCE_M: f64 = 1e-2;

/// A short run of the built-in sequence, small enough for a software adapter in a browser: the
/// poses of its frames.
///
/// # Errors
/// The run's.
pub async fn short_run(engine: Engine) -> Result<Vec<Pose>, SlamError> {
    let options = SyntheticOptions { width: 64, height: 48, frames: 6, ..SyntheticOptions::tiny() };
    let mut sequence = SyntheticSequence::new(options);
    let mut config = Config::default();
    config.mapping.every = 2;
    config.mapping.rays = 256;
    config.mapping.first_iterations = 24;
    config.mapping.iterations = 4;
    config.mapping.final_iterations = 4;
    config.mapping.semantic_iterations = 4;
    config.sampling.stratified = 16;
    // The tracker whose poses are computed on the engine from first to last: `align` may leave them
    // to the odometry, which is the host's everywhere.
    config.tracking.tracker = Tracker::Render;
    // Steps cut short would end wherever rounding sent them.
    config.tracking.render_rays = 1024;
    config.tracking.render_iterations = 12;
    let mut run = Run::new(engine, config, sequence.info()).await?;
    run.to_end(&mut sequence, &mut ()).await.map_err(|error| match error {
        RunError::Input { index, error } => SlamError::Frame {
            frame: index,
            field: "built-in sequence",
            found: error.to_string(),
            expected: "a frame".into(),
        },
        RunError::Frame { error, .. } | RunError::Finish(error) | RunError::Resume(error) => error,
    })?;
    Ok(run.slam().trajectory().iter().map(|p| p.world_from_camera).collect())
}

/// Largest distance between the positions of two runs \[m\]; infinite for unequal lengths.
pub fn largest_gap_m(a: &[Pose], b: &[Pose]) -> f64 {
    if a.len() != b.len() || a.is_empty() {
        return f64::INFINITY;
    }
    let gap = |(a, b): (&Pose, &Pose)| a.translation.distance(b.translation);
    // NaN must not be lost as `max` would lose it.
    a.iter()
        .zip(b)
        .map(gap)
        .fold(0.0_f64, |most, x| if most.is_nan() || x <= most { most } else { x })
}
