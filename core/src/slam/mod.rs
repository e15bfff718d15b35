//! The whole system: frames in, poses and a map out.
//!
//! [`Slam::process`] tracks a frame, maps it when it is due, and reports. Nothing here waits for a
//! clock, a file or a thread: the host owns those.
mod checkpoint;
mod checkpoint_file;
mod live;
mod mapping;
mod output;
mod parameters;
mod resume;
mod semantics;
mod tracking;

#[cfg(all(test, feature = "std"))]
mod tests;

pub use checkpoint::{Checkpoint, Dtype, Tensor};
pub use live::{LiveMesh, MeshChunk};
pub use output::View;
pub use parameters::ParameterCounts;
pub use resume::Resuming;

use crate::{
    config::{Config, ConfigError, Tracker},
    engine::{Engine, EngineError},
    frame::{Bounds, Frame, SequenceInfo},
    keyframe::Keyframe,
    map::{AnchorCounts, Map, Scratch},
    mesh::MeshError,
    pose::Pose,
    recording::Recording,
    track::odometry::{ColourRegistration, Odometer, OdometryConfig, OdometryError},
};
use alloc::{borrow::Cow, boxed::Box, format, string::String, vec::Vec};
use core::{future::Future, pin::Pin};

/// What a run could not do.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SlamError {
    /// The engine failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The configuration is not usable.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Tracking could not even be tried.
    #[error(transparent)]
    Odometry(#[from] OdometryError),
    /// Meshing failed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A frame does not fit the sequence.
    #[error("frame {frame}: {field}: found {found}, expected {expected}")]
    Frame {
        /// `Frame::index`.
        frame: usize,
        /// What part of it.
        field: &'static str,
        /// What it is.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// Asked for something that needs a map before the first frame.
    #[error("there is no map yet: process a frame first")]
    NoMap,
    /// The map holds values that are not finite.
    #[error("the map is not finite after frame {frame}: lower the learning rates")]
    NotFinite {
        /// Last frame mapped.
        frame: usize,
    },
    /// A checkpoint that cannot be continued from.
    #[error("checkpoint: {field}: found {found}, expected {expected}")]
    Checkpoint {
        /// Tensor or metadata entry.
        field: String,
        /// What is there.
        found: String,
        /// What should be there.
        expected: String,
    },
}

/// How a frame's pose came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackingStatus {
    /// The first frame: its pose defines the world.
    First,
    /// Located.
    Tracked,
    /// Not located; its pose is a guess and the map ignores it.
    Lost,
}

/// The pose of one frame.
#[derive(Clone, Copy, Debug)]
pub struct PoseEstimate {
    /// `Frame::index`.
    pub frame: usize,
    /// Time stamp \[s\].
    pub time_s: f64,
    /// The pose.
    pub world_from_camera: Pose,
    /// How it came about.
    pub status: TrackingStatus,
}

/// Mean losses of the last mapping iteration, weighted as optimised.
#[derive(Clone, Copy, Debug, Default)]
pub struct Losses {
    /// Sum of the others.
    pub total: f64,
    /// Signed distance.
    pub sdf: f64,
    /// Rendered depth.
    pub depth: f64,
    /// Rendered colour.
    pub color: f64,
    /// Cross-entropy.
    pub semantic: f64,
}

/// What happened to a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// How its pose came about.
    pub status: TrackingStatus,
    /// Its pose at this moment; mapping may correct it later.
    pub world_from_camera: Pose,
    /// Time of tracking \[s\]; 0 without a clock.
    pub tracking_s: f64,
    /// Time of mapping \[s\]; 0 without a clock.
    pub mapping_s: f64,
    /// Time of both \[s\].
    pub total_s: f64,
    /// Losses, when the frame was mapped.
    pub losses: Option<Losses>,
    /// Whether it became a keyframe.
    pub keyframe: bool,
}

/// The depth image of a mapped frame at reduced size: what was observed, for culling meshes.
#[derive(Clone, Debug)]
pub(crate) struct Observation {
    pub frame: usize,
    pub depth: Vec<u16>,
}

/// Called between slices of a long optimisation with the iterations done and their number; work
/// goes on when its future is ready. A host with an event loop returns to it here.
pub type Breathe = fn(done: u32, total: u32) -> Pin<Box<dyn Future<Output = ()>>>;

/// The system.
pub struct Slam {
    config: Config,
    breathe: Option<Breathe>,
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
    keyframes: Vec<Keyframe>,
    observations: Vec<Observation>,
    free_slots: Vec<u32>,
    /// Slots from here on have never held a frame.
    used_slots: u32,
    /// Batches so far: the counter of the random numbers.
    iteration: u32,
    bounds_refused: bool,
    class_counts: semantics::ClassCounts,
    mapping_calls: u32,
    /// Iterations of [`Slam::finish`] that are done.
    finished_iterations: u32,
    anchor_history: Vec<(usize, AnchorCounts)>,
    /// Restored without odometry and images: takes no frames.
    only_shown: bool,
    clock: Option<fn() -> f64>,
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
            breathe: None,
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
            class_counts: semantics::ClassCounts::default(),
            mapping_calls: 0,
            finished_iterations: 0,
            anchor_history: Vec::new(),
            only_shown: false,
            clock: None,
        })
    }

    /// Gives the system a clock \[s\]; without one reports carry no times.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = Some(clock);
    }

    /// Cuts optimisations into slices of some iterations: after each the engine's work is waited
    /// for, and `breathe` is called.
    pub fn set_breathe(&mut self, breathe: Breathe) {
        self.breathe = Some(breathe);
    }

    /// Track a frame and, when it is due, map it.
    ///
    /// # Errors
    /// A frame of another size, a first frame without depth or pose, engine failures. A frame that
    /// cannot be located is no error: its status is [`TrackingStatus::Lost`].
    pub async fn process(&mut self, frame: &Frame) -> Result<FrameReport, SlamError> {
        self.check(frame)?;
        if self.only_shown {
            return Err(SlamError::Frame {
                frame: frame.index,
                field: "map",
                found: "one that was restored to be shown".into(),
                expected: "a run, new or resumed".into(),
            });
        }
        let hash = frame.content_hash();
        self.finished_iterations = 0;
        let now = |s: &Slam| s.clock.map_or(0.0, |c| c());
        let start = now(self);
        let (status, new_reference) = self.track(frame).await?;
        self.hashes.push(hash);
        let tracked = now(self);
        let due = frame.index.is_multiple_of(self.config.mapping.every as usize);
        let mut losses = None;
        let mut keyframe = false;
        if status != TrackingStatus::Lost && (due || new_reference) {
            let frame = self.registered(frame);
            let mapped = self.map(&frame, new_reference).await?;
            losses = Some(mapped.0);
            keyframe = mapped.1;
        }
        let end = now(self);
        self.follow_odometer();
        let world_from_camera = self.frames.last().map_or(Pose::IDENTITY, |f| f.world_from_camera);
        Ok(FrameReport {
            status,
            world_from_camera,
            tracking_s: tracked - start,
            mapping_s: end - tracked,
            total_s: end - start,
            losses,
            keyframe,
        })
    }

    /// Where the map takes the colour image to lie on the depth image: what the odometry has found,
    /// the identity as long as nothing speaks against it (and with true poses, where no odometry
    /// runs).
    pub fn colour_registration(&self) -> ColourRegistration {
        self.registration
    }

    /// The frame as the map is trained with it: colour and labels in the depth camera's pixels.
    /// Compare rendered views with this.
    pub fn registered<'a>(&self, frame: &'a Frame) -> Cow<'a, Frame> {
        self.registration.registered(frame, &self.info.camera)
    }

    /// Takes over a registration of colour that the odometry found or improved. It settles only
    /// after some keyframes; the images of those before are still stored, so they are read
    /// back, resampled and stored again. What the map has already learnt from them fades as later
    /// iterations draw from the corrected images.
    pub(super) async fn follow_registration(&mut self, frame: usize) -> Result<(), SlamError> {
        let found = self.odometer.colour_registration();
        if found == self.registration {
            return Ok(());
        }
        self.registrations.push((frame, found));
        // The stored images have the former registration applied.
        let change = ColourRegistration { scale: found.scale / self.registration.scale };
        self.registration = found;
        let camera = self.info.camera;
        let slots: Vec<u32> = self.keyframes.iter().map(|k| k.slot).collect();
        for slot in slots {
            let (engine, map, _) = self.mapped()?;
            let image = map.frames.read_color(engine, slot).await?;
            let mut r = Recording::default();
            map.frames.upload_color(&mut r, slot, &change.resampled(&image, &camera));
            engine.submit(&r)?;
        }
        Ok(())
    }

    /// The poses so far, with every correction.
    pub fn trajectory(&self) -> Vec<PoseEstimate> {
        self.frames.clone()
    }

    /// The keyframes kept for mapping.
    pub fn keyframes(&self) -> &[Keyframe] {
        &self.keyframes
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

    /// The map's box \[m\], once there is a map.
    pub fn bounds(&self) -> Option<Bounds> {
        self.map.as_ref().map(|m| m.shape.bounds)
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

    fn check(&self, frame: &Frame) -> Result<(), SlamError> {
        let pixels = self.info.camera.pixels();
        let found = [
            ("colour image", frame.color.len()),
            ("depth image", frame.depth.len()),
            ("label image", frame.labels.as_ref().map_or(pixels, Vec::len)),
        ];
        for (field, n) in found {
            if n != pixels {
                return Err(SlamError::Frame {
                    frame: frame.index,
                    field,
                    found: format!("{n} pixels"),
                    expected: format!("{pixels} pixels"),
                });
            }
        }
        let channels = frame.features.as_ref().map_or(0, |f| f.channels);
        if channels != self.info.feature_channels {
            return Err(SlamError::Frame {
                frame: frame.index,
                field: "feature map",
                found: format!("{channels} channels"),
                expected: format!("{} channels", self.info.feature_channels),
            });
        }
        if let Some(f) = &frame.features
            && (f.values.len() != f.channels * f.height * f.width || f.values.is_empty())
        {
            return Err(SlamError::Frame {
                frame: frame.index,
                field: "feature map",
                found: format!("{} values", f.values.len()),
                expected: format!("{} x {} x {}", f.channels, f.height, f.width),
            });
        }
        if frame.truth.is_some_and(|p| !p.is_finite()) {
            return Err(SlamError::Frame {
                frame: frame.index,
                field: "true pose",
                found: "a number that is not finite".into(),
                expected: "finite numbers, or no pose".into(),
            });
        }
        Ok(())
    }

    /// Takes over the poses of all frames from the odometer, which moves them with its keyframes.
    fn follow_odometer(&mut self) {
        if self.config.tracking.tracker == Tracker::Truth {
            return;
        }
        for (entry, (_, pose, _)) in self.frames.iter_mut().zip(self.odometer.trajectory()) {
            entry.world_from_camera = pose;
        }
        for k in &mut self.keyframes {
            if let Some(f) = self.frames.get(k.frame) {
                k.world_from_camera = f.world_from_camera;
            }
        }
    }
}
