//! Locating a frame: odometry, then refinement against the field.
use super::{
    PoseEstimate, Slam, SlamError, TrackingStatus, points::sample_points, report::Tracked,
};
use crate::{
    commands::Commands,
    config::Tracker,
    frame::Frame,
    kernels::{
        pose_step::POSE_BEST_LOSS,
        shared::{FLAG_GUIDED, FLAG_MASK, FLAG_POSE},
    },
    map::{Batch, SemanticSupervision, passes, pose_from_words},
    pose::Pose,
    track::{
        gauss_newton::{self, Guard},
        odometry::RgbdPyramid,
    },
};

impl Slam {
    /// Adds the frame's pose to the trajectory.
    pub(super) async fn track(&mut self, frame: &Frame) -> Result<Tracked, SlamError> {
        let tracked = match self.config.tracking.tracker {
            Tracker::Truth => self.take_truth(frame)?,
            Tracker::Align | Tracker::Render => self.locate(frame).await?,
        };
        self.frames.push(PoseEstimate {
            frame: frame.index,
            time_s: frame.time_s,
            world_from_camera: tracked.world_from_camera,
            status: tracked.status,
        });
        Ok(tracked)
    }

    /// `truth`: the frame brings its pose; without one it is lost.
    fn take_truth(&self, frame: &Frame) -> Result<Tracked, SlamError> {
        let first = self.frames.is_empty();
        let status = match frame.truth {
            None if first => {
                return Err(SlamError::Frame {
                    frame: frame.index,
                    field: "true pose",
                    found: "none".into(),
                    expected: "a pose, since the tracker is `truth`".into(),
                });
            }
            None => TrackingStatus::Lost,
            Some(_) if first => TrackingStatus::First,
            Some(_) => TrackingStatus::Tracked,
        };
        let last = self.frames.last().map_or(Pose::IDENTITY, |f| f.world_from_camera);
        let world_from_camera = frame.truth.unwrap_or(last);
        Ok(Tracked { status, world_from_camera, is_reference: first })
    }

    /// Odometry against keyframes of its own, then refinement against the map.
    async fn locate(&mut self, frame: &Frame) -> Result<Tracked, SlamError> {
        let first = self.frames.is_empty();
        let config = self.odometer.config().pyramid.clone();
        let pyramid = RgbdPyramid::new(frame, &self.info.camera, self.info.depth_unit_m, &config)?;
        let start = first.then(|| frame.truth.unwrap_or(Pose::IDENTITY));
        let found = self.odometer.track(pyramid, start)?;
        self.follow_registration(frame.index).await?;
        let start = found.world_from_camera;
        let tracked = |status, world_from_camera, is_reference| Tracked {
            status,
            world_from_camera,
            is_reference,
        };
        if found.lost {
            return Ok(tracked(TrackingStatus::Lost, start, false));
        }
        if first {
            return Ok(tracked(TrackingStatus::First, start, true));
        }
        let frame = &*self.registered(frame);
        let refined = match self.config.tracking.tracker {
            Tracker::Align => self.align(frame, &start, found.quality.information).await?,
            Tracker::Render => self.render_track(frame, &start).await?,
            Tracker::Truth => None,
        };
        if let Some(refined) = refined {
            self.odometer.set_last_pose(refined);
        }
        let pose = refined.unwrap_or(start);
        Ok(tracked(TrackingStatus::Tracked, pose, found.keyframe.is_some()))
    }

    /// `align`: damped Gauss-Newton against the field, starting at the odometry's pose, which
    /// weighs as much as its information says. `None` when a guard refused the result.
    async fn align(
        &mut self,
        frame: &Frame,
        start: &Pose,
        prior: [[f64; 6]; 6],
    ) -> Result<Option<Pose>, SlamError> {
        let t = self.config.tracking.clone();
        if t.align_iterations == 0 || t.align_field_weight == 0.0 {
            return Ok(None);
        }
        let (camera, unit, seed) = (self.info.camera, self.info.depth_unit_m, self.config.seed);
        let points = sample_points(frame, &camera, unit, t.align_pixels as usize, seed);
        let (engine, map, scratch) = self.mapped()?;
        let mut r = Commands::default();
        passes::upload_pixels(&mut r, scratch, &points);
        engine.submit(&r)?;
        let guard = Guard { offered: points.len(), ..Guard::default() };
        let mut solver = gauss_newton::Solver::new(*start, prior, t.align_field_weight, guard);
        for _ in 0..t.align_iterations {
            let (pose, count) = (solver.candidate(), points.len() as u32);
            let sums = passes::align(engine, map, scratch, &pose, count).await?;
            if solver.step(&sums) {
                break;
            }
        }
        Ok(solver.result())
    }

    /// `render`: Adam on the pose through volume rendering; the pose of the smallest loss is kept.
    async fn render_track(
        &mut self,
        frame: &Frame,
        start: &Pose,
    ) -> Result<Option<Pose>, SlamError> {
        let t = self.config.tracking.clone();
        let s = self.config.sampling.clone();
        let Some(slot) = self.take_slot() else { return Ok(None) };
        let first_iteration = self.iteration;
        self.iteration += t.render_iterations + 1;
        let (engine, map, scratch) = self.mapped()?;
        let mut r = Commands::default();
        map.frames.upload_frame(&mut r, slot, frame);
        map.frames.upload_pose(&mut r, slot, start);
        scratch.upload_window(&mut r, &[(slot, false)]);
        // One pass more than steps: the last step's pose is judged, too.
        for i in 0..=t.render_iterations {
            let batch = Batch {
                frames: 1,
                rays_per_frame: t.render_rays,
                stratified: s.stratified,
                surface: s.surface,
                flags: FLAG_GUIDED | FLAG_POSE | FLAG_MASK,
                loss: &t.render_loss,
                iteration: first_iteration + i,
                first: 0,
                camera: None,
                rare_share: 0.0,
                supervision: SemanticSupervision::default(),
            };
            passes::record_forward(&mut r, map, scratch, &batch);
            passes::record_backward(&mut r, map, scratch, &batch);
            let (v, w) = (t.render_rate_translation_m, t.render_rate_rotation_rad);
            passes::record_pose_step(&mut r, map, scratch, &batch, v, w, i == 0);
        }
        engine.submit(&r)?;
        let state = map.frames.read_pose_state(engine, slot).await?;
        self.free_slots.push(slot);
        let pose = pose_from_words(&state[POSE_BEST_LOSS + 1..POSE_BEST_LOSS + 13]);
        Ok(pose.filter(|_| state[POSE_BEST_LOSS] < 1e30))
    }
}
