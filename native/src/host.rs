//! The command line as the program around a run: its clock and its progress.
use crate::{evaluation, progress::Progress};
use mte_slam_core::slam::{FrameReport, Slam, TrackingStatus};
use mte_slam_run::{Event, Host};
use mte_slam_types::{pose::Pose, sequence::Sequence};
use std::time::Instant;

/// Shows how a run goes.
pub struct Terminal<'a> {
    start: Instant,
    /// One step per frame.
    progress: &'a mut Progress,
    /// The true pose of each frame.
    truth: Vec<Option<Pose>>,
}

impl<'a> Terminal<'a> {
    /// For a run over `sequence`; each frame is a step of `progress`.
    pub fn new(progress: &'a mut Progress, sequence: &dyn Sequence) -> Terminal<'a> {
        let truth = (0..sequence.info().frames).map(|i| sequence.truth(i)).collect();
        Terminal { start: Instant::now(), progress, truth }
    }

    /// Shows a line that stays.
    pub fn note(&self, text: &str) {
        self.progress.note(text);
    }

    fn message(&self, slam: &Slam, report: &FrameReport) -> String {
        let estimates = slam.trajectory();
        let truth: Vec<_> =
            estimates.iter().map(|e| self.truth.get(e.frame).copied().flatten()).collect();
        let mut parts = Vec::new();
        if let Ok(score) = evaluation::trajectory(&estimates, &truth, |_| true) {
            parts.push(format!("ATE {:.2} cm", score.report.aligned_cm.rmse));
        }
        if let Some(losses) = &report.losses {
            parts.push(format!("loss {:.3}", losses.total));
        }
        let lost = estimates.iter().filter(|e| e.status == TrackingStatus::Lost).count();
        if lost > 0 {
            parts.push(format!("{lost} lost"));
        }
        parts.join("  ")
    }
}

impl Host for Terminal<'_> {
    fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Processed { report, log, slam } => {
                let done = log.frame as u64 + 1;
                if self.progress.wants_message(done) {
                    let message = self.message(slam, report);
                    self.progress.set(done, || message);
                }
            }
            Event::Notice(text) => self.note(&format!("note: {text}")),
            _ => {}
        }
    }
}
