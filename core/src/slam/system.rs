//! What a run holds.
use super::{
    class_counts::ClassCounts,
    error::SlamError,
    keyframes::{MapKeyframe, Observation},
    report::PoseEstimate,
};
use crate::{
    config::Config,
    engine::Engine,
    frame::SequenceInfo,
    map::{AnchorCounts, Map, Scratch},
    track::odometry::{ColorRegistration, Odometer},
};
use alloc::vec::Vec;

/// The system.
pub struct Slam {
    pub(super) config: Config,
    pub(super) info: SequenceInfo,
    pub(super) engine: Engine,
    /// Made with the first frame, whose depth may decide the bounds.
    pub(super) map: Option<Map>,
    /// The buffers that the passes over the map work in.
    pub(super) scratch: Option<Scratch>,
    pub(super) odometer: Odometer,
    /// Where the colours of the stored images have been found to lie.
    pub(super) registration: ColorRegistration,
    /// The changes of `registration`: from which frame on it was in force.
    pub(super) registrations: Vec<(usize, ColorRegistration)>,
    pub(super) frames: Vec<PoseEstimate>,
    /// [`Frame::content_hash`] of each frame.
    pub(super) hashes: Vec<u64>,
    pub(super) keyframes: Vec<MapKeyframe>,
    pub(super) observations: Vec<Observation>,
    pub(super) free_slots: Vec<u32>,
    /// Slots from here on have never held a frame.
    pub(super) used_slots: u32,
    /// Batches so far: the counter of the random numbers.
    pub(super) iteration: u32,
    pub(super) bounds_refused: bool,
    pub(super) class_counts: ClassCounts,
    pub(super) mapping_calls: u32,
    /// Iterations of [`Slam::finish`] that are done.
    pub(super) finished_iterations: u32,
    pub(super) anchor_history: Vec<(usize, AnchorCounts)>,
    /// Restored without odometry and images: takes no frames.
    pub(super) only_shown: bool,
}

/// Slot whose pose is used for tracking and views; it has no images.
pub(super) const VIEW_SLOT: u32 = 0;

impl Slam {
    /// A system that has seen nothing. The map's buffers are made with the first frame.
    ///
    /// # Errors
    /// [`SlamError::Config`].
    pub async fn new(
        engine: Engine,
        config: Config,
        info: &SequenceInfo,
    ) -> Result<Slam, SlamError> {
        Slam::on_engine(engine, config, info)
    }

    pub(super) fn on_engine(
        engine: Engine,
        config: Config,
        info: &SequenceInfo,
    ) -> Result<Slam, SlamError> {
        config.validate()?;
        let odometer = Odometer::new(config.odometry.clone());
        Ok(Slam {
            config,
            info: info.clone(),
            engine,
            map: None,
            scratch: None,
            odometer,
            registration: ColorRegistration::default(),
            registrations: Vec::new(),
            frames: Vec::new(),
            hashes: Vec::new(),
            keyframes: Vec::new(),
            observations: Vec::new(),
            free_slots: Vec::new(),
            used_slots: 0,
            iteration: 0,
            bounds_refused: false,
            class_counts: ClassCounts::default(),
            mapping_calls: 0,
            finished_iterations: 0,
            anchor_history: Vec::new(),
            only_shown: false,
        })
    }

    /// The poses so far, with every correction.
    pub fn trajectory(&self) -> Vec<PoseEstimate> {
        self.frames.clone()
    }

    /// What the redundancy suppressor did: after each call of the optimisation the last frame's
    /// index and the counts so far. Empty without it.
    pub fn anchor_history(&self) -> &[(usize, AnchorCounts)] {
        &self.anchor_history
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// What is known of the sequence.
    pub fn info(&self) -> &SequenceInfo {
        &self.info
    }

    /// Bytes of the engine's buffers.
    pub fn memory_bytes(&self) -> usize {
        self.engine.allocated_bytes() as usize
    }

    /// Most that [`Slam::memory_bytes`] has been, as while bounds grew \[bytes\].
    pub fn peak_memory_bytes(&self) -> u64 {
        self.engine.peak_bytes()
    }

    /// Engine, map and scratch buffers, once there is a map.
    pub(super) fn mapped(&mut self) -> Result<(&mut Engine, &mut Map, &Scratch), SlamError> {
        match (&mut self.map, &self.scratch) {
            (Some(map), Some(scratch)) => Ok((&mut self.engine, map, scratch)),
            _ => Err(SlamError::NoMap),
        }
    }
}
