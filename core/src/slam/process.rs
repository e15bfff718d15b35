//! A frame's way through the system: the paper's figure 2.
use super::{FrameReport, Pace, Slam, SlamError, Unpaced, plan::OptimisationPlan};
use crate::frame::Frame;

impl Slam {
    /// Tracks a frame and, when it is due, maps it; reports no times.
    ///
    /// # Errors
    /// A frame of another size, a first frame without depth or pose, engine failures. A frame that
    /// cannot be located is no error: its status is
    /// [`TrackingStatus::Lost`](super::TrackingStatus::Lost).
    pub async fn process(&mut self, frame: &Frame) -> Result<FrameReport, SlamError> {
        self.process_with(frame, &mut Unpaced).await
    }

    /// [`Slam::process`] with the clock and the event loop of the program around it.
    ///
    /// # Errors
    /// As [`Slam::process`].
    pub async fn process_with(
        &mut self,
        frame: &Frame,
        pace: &mut dyn Pace,
    ) -> Result<FrameReport, SlamError> {
        let hash = self.admit(frame)?;
        self.finished_iterations = 0;
        let start_s = pace.now_s();
        // The camera's pose: by odometry, then against the map.
        let tracked = self.track(frame).await?;
        self.hashes.push(hash);
        let tracked_s = pace.now_s();
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
            losses = Some(self.optimise(&plan, pace).await?);
            self.mapping_calls += 1;
            if !keyframe {
                self.release_newest();
            }
        }
        let end_s = pace.now_s();
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
}
