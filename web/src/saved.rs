//! A run's state, kept now and then, so that a lost device, a crash or a reload costs a few frames:
//! the core's checkpoint, with what this crate knows of the run in an entry of its metadata.
use crate::{
    events::emit, failure::Failure, message::*, platform::clock_s, run::Run, settings::Settings,
};
use js_sys::Uint8Array;
use mte_slam_core::slam::Checkpoint;
use mte_slam_types::{camera::Camera, frame::SequenceInfo};
use serde::{Deserialize, Serialize};

/// Name of the metadata entry.
const ENTRY: &str = "session";
/// Shortest time between two states \[s\].
const PAUSE_S: f64 = 5.0;
/// At most one part in so many of the time goes into making states.
const SHARE: f64 = 20.0;

/// What a session adds to the core's checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Progress {
    /// The recording's name, to be compared with what is opened.
    pub name: String,
    /// Frames of the recording.
    pub frames: usize,
    /// Its camera.
    pub camera: Camera,
    /// How it is processed.
    pub settings: Settings,
    /// The frame that comes next.
    pub next: usize,
    /// Time from the first frame \[s\].
    pub seconds: f64,
    /// Whether the map has been refined after the last frame.
    pub finished: bool,
    /// Figures of the frames so far.
    pub metrics: Vec<MetricsEvent>,
}

/// A checkpoint and the session's part of it.
pub struct SavedRun {
    pub checkpoint: Checkpoint,
    pub progress: Progress,
}

fn wrong(what: &str, found: impl std::fmt::Debug, expected: impl std::fmt::Debug) -> Failure {
    let message = format!("saved run: {what}: found {found:?}, expected {expected:?}");
    Failure::new(ErrorKind::BadFile, message)
}

impl SavedRun {
    /// From the bytes of a `saved` event.
    pub fn from_bytes(bytes: &[u8]) -> Result<SavedRun, Failure> {
        let mut checkpoint = Checkpoint::from_bytes(bytes)?;
        let Some(text) = checkpoint.metadata.remove(ENTRY) else {
            return Err(wrong("metadata", "nothing", ENTRY));
        };
        let progress: Progress = serde_json::from_str(&text)
            .map_err(|e| wrong(ENTRY, e.to_string(), "the state of a session"))?;
        if progress.next == 0 || progress.next > progress.frames {
            return Err(wrong("next frame", progress.next, 1..=progress.frames));
        }
        Ok(SavedRun { checkpoint, progress })
    }
}

impl Progress {
    /// Whether this is the recording that was saved, as far as can be said without its images.
    ///
    /// # Errors
    /// Says what differs.
    pub fn check(&self, found: &SequenceInfo) -> Result<(), Failure> {
        let SequenceInfo { name, frames, camera, .. } = found;
        if *name != self.name {
            return Err(wrong("recording", name, &self.name));
        }
        if *frames != self.frames {
            return Err(wrong("frames", frames, self.frames));
        }
        if *camera != self.camera {
            return Err(wrong("camera", camera, self.camera));
        }
        Ok(())
    }
}

impl Run {
    /// Whether it is time for another state.
    pub fn save_is_due(&self) -> bool {
        self.keep && clock_s() - self.saved_s >= self.save_pause_s
    }

    /// Emits the state of the run.
    pub async fn save(&mut self) -> Result<(), Failure> {
        // Before the first frame there is nothing that opening again would not bring.
        if self.next == 0 || !self.settled {
            return Ok(());
        }
        let begun_s = clock_s();
        let info = self.feed.info();
        let progress = Progress {
            name: info.name.clone(),
            frames: info.frames,
            camera: info.camera,
            settings: self.settings.clone(),
            next: self.next,
            seconds: self.seconds(),
            finished: self.finished,
            metrics: self.metrics.clone(),
        };
        let text = serde_json::to_string(&progress)
            .map_err(|e| Failure::new(ErrorKind::Engine, e.to_string()))?;
        let frames = info.frames;
        let mut checkpoint = self.slam.checkpoint().await?;
        checkpoint.metadata.insert(ENTRY.into(), text);
        let parts = checkpoint.parts();
        let bytes = Uint8Array::new_with_length(parts.iter().map(|p| p.len() as u32).sum());
        let mut at = 0;
        for part in &parts {
            let end = at + part.len() as u32;
            bytes.subarray(at, end).copy_from(part);
            at = end;
        }
        emit(&Event::Saved(SavedEvent { frame: self.next, frames, bytes: bytes.into() }));
        self.saved_s = clock_s();
        self.save_pause_s = PAUSE_S.max(SHARE * (self.saved_s - begun_s));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_saved_run_is_refused() {
        let error = |bytes: &[u8]| SavedRun::from_bytes(bytes).err().map(|f| f.0.message);
        assert!(error(b"nothing").is_some_and(|m| m.contains("checkpoint")));
        let plain = Checkpoint::default().to_bytes();
        assert!(error(&plain).is_some_and(|m| m.contains("session")));
        let mut other = Checkpoint::default();
        other.metadata.insert(ENTRY.into(), "{}".into());
        assert!(error(&other.to_bytes()).is_some_and(|m| m.contains("missing field")));
    }
}
