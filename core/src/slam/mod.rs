//! The whole system: frames in, poses and a map out.
//!
//! [`Slam::process`] takes a frame through the paper's figure 2: it tracks the frame, decides
//! whether it is mapped and stays as a keyframe, and optimises map and poses over a window of
//! keyframes, with the fused features and the anchors as supervision. [`Slam::finish`] optimises
//! over all of them at the end. Nothing here waits for a clock, a file or a thread: the host owns
//! those.
//!
//! What an optimisation does is planned by pure functions (`plan.rs`) and then recorded
//! (`mapping.rs`).
mod admission;
mod bounds;
mod checkpoint;
mod checkpoint_file;
mod error;
mod finish;
mod host;
mod keyframes;
mod live;
mod mapping;
mod output;
mod parameters;
mod plan;
mod points;
mod registration;
mod report;
mod resume;
mod semantics;
mod tracking;

#[cfg(all(test, feature = "std"))]
mod tests;

pub use checkpoint::{Checkpoint, Dtype, Tensor};
pub use error::SlamError;
pub use host::Breathe;
pub use keyframes::MapKeyframe;
pub use live::{LiveMesh, MeshChunk};
pub use output::View;
pub use parameters::ParameterCounts;
pub use report::{FrameReport, Losses, PoseEstimate, TrackingStatus};
pub use resume::Resuming;

use crate::{
    config::Config,
    engine::Engine,
    frame::{Frame, SequenceInfo},
    map::{AnchorCounts, Map, Scratch},
    track::odometry::{ColourRegistration, Odometer, OdometryConfig},
};
use alloc::vec::Vec;
use host::HostHooks;
use keyframes::Observation;
use plan::OptimisationPlan;
use semantics::ClassCounts;

/// The system.
pub struct Slam {
    config: Config,
    host: HostHooks,
    info: SequenceInfo,
    engine: Engine,
    /// Made with the first frame, whose depth may decide the bounds.
    map: Option<Map>,
    /// The buffers that the passes over the map work in.
    scratch: Option<Scratch>,
    odometer: Odometer,
    /// Where the colours of the stored images have been found to lie.
    registration: ColourRegistration,
    /// The changes of `registration`: from which frame on it was in force.
    registrations: Vec<(usize, ColourRegistration)>,
    frames: Vec<PoseEstimate>,
    /// [`Frame::content_hash`] of each frame.
    hashes: Vec<u64>,
    keyframes: Vec<MapKeyframe>,
    observations: Vec<Observation>,
    free_slots: Vec<u32>,
    /// Slots from here on have never held a frame.
    used_slots: u32,
    /// Batches so far: the counter of the random numbers.
    iteration: u32,
    bounds_refused: bool,
    class_counts: ClassCounts,
    mapping_calls: u32,
    /// Iterations of [`Slam::finish`] that are done.
    finished_iterations: u32,
    anchor_history: Vec<(usize, AnchorCounts)>,
    /// Restored without odometry and images: takes no frames.
    only_shown: bool,
}

/// Slot whose pose is used for tracking and views; it has no images.
pub(crate) const VIEW_SLOT: u32 = 0;

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

    fn on_engine(engine: Engine, config: Config, info: &SequenceInfo) -> Result<Slam, SlamError> {
        config.validate()?;
        Ok(Slam {
            config,
            host: HostHooks::default(),
            info: info.clone(),
            engine,
            map: None,
            scratch: None,
            odometer: Odometer::new(OdometryConfig::default()),
            registration: ColourRegistration::default(),
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

    /// Tracks a frame and, when it is due, maps it.
    ///
    /// # Errors
    /// A frame of another size, a first frame without depth or pose, engine failures. A frame that
    /// cannot be located is no error: its status is [`TrackingStatus::Lost`].
    pub async fn process(&mut self, frame: &Frame) -> Result<FrameReport, SlamError> {
        let hash = self.admit(frame)?;
        self.finished_iterations = 0;
        let start_s = self.host.now_s();
        // The camera's pose: by odometry, then against the map.
        let tracked = self.track(frame).await?;
        self.hashes.push(hash);
        let tracked_s = self.host.now_s();
        let (mut losses, mut keyframe) = (None, false);
        if self.is_mapped(frame, &tracked) {
            let frame = &*self.registered(frame);
            // The map's box holds what the frame sees.
            let seen = self.seen_points(frame, &tracked.world_from_camera);
            self.fit_bounds(&seen, tracked.world_from_camera.translation).await?;
            // The frame joins the keyframes, at least until the next one.
            keyframe = self.becomes_keyframe(frame, &tracked);
            self.store(frame, tracked.world_from_camera)?;
            // Fusion, suppressor, rendering losses: map and poses of a window of keyframes.
            let near = self.overlapping(&seen);
            let plan = OptimisationPlan::for_frame(&self.config, &self.progress(), near);
            losses = Some(self.optimise(&plan).await?);
            self.mapping_calls += 1;
            if !keyframe {
                self.release_newest();
            }
        }
        let end_s = self.host.now_s();
        self.follow_odometer();
        let world_from_camera =
            self.frames.last().map_or(tracked.world_from_camera, |f| f.world_from_camera);
        Ok(FrameReport {
            status: tracked.status,
            world_from_camera,
            tracking_s: tracked_s - start_s,
            mapping_s: end_s - tracked_s,
            total_s: end_s - start_s,
            losses,
            keyframe,
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
    fn mapped(&mut self) -> Result<(&mut Engine, &mut Map, &Scratch), SlamError> {
        match (&mut self.map, &self.scratch) {
            (Some(map), Some(scratch)) => Ok((&mut self.engine, map, scratch)),
            _ => Err(SlamError::NoMap),
        }
    }
}
