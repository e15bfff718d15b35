//! Maps frames as they come, from a closure that stands for a camera's driver. How many there will
//! be is not known when the run begins.
//!
//! ```text
//! cargo run --release -p mte-slam-examples --example live_camera
//! ```
use mte_slam_core::{
    config::Config,
    engine::Engine,
    slam::{PoseEstimate, TrackingStatus},
};
use mte_slam_run::{Event, Host, Live, Run};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};
use std::{error::Error, time::Instant};

/// Prints where the camera is, with a clock of its own.
struct Terminal {
    started: Instant,
}

impl Host for Terminal {
    fn now_s(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    fn event(&mut self, event: Event<'_>) {
        let Event::Processed { report, log, .. } = event else { return };
        match report.status {
            TrackingStatus::Lost => println!("frame {}: lost", log.frame),
            _ => println!(
                "frame {}: {:.3} m, {:.0} ms",
                log.frame,
                report.world_from_camera.translation,
                1000.0 * log.total_s
            ),
        }
    }
}

/// Maps the frames of a camera until it gives none; returns its path.
pub fn map_live(
    info: &SequenceInfo,
    camera: impl FnMut() -> Option<Frame>,
) -> Result<Vec<PoseEstimate>, Box<dyn Error>> {
    let config = Config::preset("tiny").unwrap_or_default();
    let mut host = Terminal { started: Instant::now() };
    pollster::block_on(async {
        let mut run = Run::new(Engine::cpu(), config, info).await?;
        run.to_end(&mut Live::new(camera), &mut host).await?;
        Ok(run.slam().trajectory())
    })
}

/// A camera that is carried through the built-in room and unplugged after some frames. A real
/// one's frames have neither labels nor true poses.
pub fn camera(frames: usize) -> (SequenceInfo, impl FnMut() -> Option<Frame>) {
    let mut room = SyntheticSequence::new(SyntheticOptions { frames, ..SyntheticOptions::tiny() });
    let known = room.info().clone();
    let info = SequenceInfo { frames: 0, classes: Default::default(), bounds: None, ..known };
    let mut next = 0;
    let driver = move || {
        let frame = room.frame(next).ok()?;
        next += 1;
        Some(Frame { labels: None, truth: None, ..frame })
    };
    (info, driver)
}

#[allow(dead_code, reason = "the tests call what it calls")]
fn main() -> Result<(), Box<dyn Error>> {
    let (info, driver) = camera(10);
    let path = map_live(&info, driver)?;
    println!("{} frames", path.len());
    Ok(())
}
