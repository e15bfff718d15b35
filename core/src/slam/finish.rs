//! The last optimisation: all keyframes once more, then the semantics, then the anchors.
use super::{
    Pace, Slam, SlamError, Unpaced,
    mapping::ITERATIONS_PER_SUBMISSION,
    plan::{FinishPlan, OptimisationPlan, Stage},
};
use crate::{commands::Commands, map::fusion};

impl Slam {
    /// Goes over all keyframes once more, with falling rates: [`Slam::finish_step`] to its end.
    ///
    /// # Errors
    /// Engine failures. Nothing happens without keyframes.
    pub async fn finish(&mut self) -> Result<(), SlamError> {
        while self.finish_step().await? {}
        Ok(())
    }

    /// A part of [`Slam::finish`], after which a checkpoint can be made. Returns whether more is to
    /// be done. Once all is done further calls do nothing, until another frame has been processed.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn finish_step(&mut self) -> Result<bool, SlamError> {
        self.finish_step_with(&mut Unpaced).await
    }

    /// [`Slam::finish_step`] with the event loop of the program around it.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn finish_step_with(&mut self, pace: &mut dyn Pace) -> Result<bool, SlamError> {
        let finish = self.finish_plan();
        let next = finish.next(self.finished_iterations);
        let Some(part) = next.filter(|_| !self.keyframes.is_empty()) else {
            return Ok(false);
        };
        if self.finished_iterations == 0 {
            self.follow_odometer();
        }
        if part.stage == Stage::Semantics && part.done == 0 {
            self.refresh_targets()?;
        }
        let plan = OptimisationPlan::for_finish(&self.config, &self.progress(), &part);
        self.optimise(&plan, pace).await?;
        self.finished_iterations += part.iterations;
        let more = self.finished_iterations < finish.iterations();
        if !more {
            self.follow_odometer();
        }
        Ok(more)
    }

    /// Iterations of [`Slam::finish`] that are done.
    pub fn finished_iterations(&self) -> u32 {
        self.finished_iterations
    }

    /// The stages of the last optimisation.
    pub(super) fn finish_plan(&self) -> FinishPlan {
        FinishPlan::new(&self.config, !self.info.classes.is_empty(), self.has_anchors())
    }

    /// Fused features of every keyframe by what the fusion has learned since.
    fn refresh_targets(&mut self) -> Result<(), SlamError> {
        let (Some(map), Some(scratch)) = (&self.map, &self.scratch) else {
            return Err(SlamError::NoMap);
        };
        for some in self.keyframes.chunks(ITERATIONS_PER_SUBMISSION as usize) {
            let mut r = Commands::default();
            for k in some {
                map.frames.upload_pose(&mut r, k.slot, &k.world_from_camera);
                fusion::record_forward(&mut r, map, scratch, k.slot);
            }
            self.engine.submit(&r)?;
        }
        Ok(())
    }
}
