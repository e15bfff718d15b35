//! A run's state, kept now and then, so that a lost device, a crash or a reload costs a few frames:
//! the run's checkpoint, with what this crate adds to it.
use crate::{failure::Failure, message::*, platform::clock_s, run::OpenRun, settings::Settings};
use js_sys::Uint8Array;
use mte_slam_core::slam::Checkpoint;
use mte_slam_run::SavedRun;
use mte_slam_types::{camera::Camera, frame::SequenceInfo};
use serde::{Deserialize, Serialize};

/// Shortest time between two states \[s\].
const PAUSE_S: f64 = 5.0;
/// At most one part in this many of the time goes into making states.
const SHARE: f64 = 20.0;

/// What a session adds to a run's checkpoint.
#[derive(Serialize, Deserialize)]
pub struct Kept {
    /// The recording's name, to be compared with what is opened.
    pub name: String,
    /// Frames of the recording.
    pub frames: usize,
    /// Its camera.
    pub camera: Camera,
    /// How it is processed.
    pub settings: Settings,
    /// Figures of the frames so far, beside those that the run keeps.
    pub figures: Vec<PageFigures>,
}

/// What the page measures of a frame, beside what the run keeps of it.
#[derive(Clone, Serialize, Deserialize)]
pub struct PageFigures {
    /// Frame.
    pub index: usize,
    /// Time of the frame with reading, meshing and drawing \[ms\].
    pub total_ms: f64,
    /// Absolute trajectory error so far \[cm\].
    pub ate_cm: Option<f64>,
    /// Buffers on the device \[bytes\].
    pub device_bytes: f64,
    /// Memory of the WebAssembly module \[bytes\].
    pub wasm_bytes: f64,
}

fn wrong(what: &str, found: impl std::fmt::Debug, expected: impl std::fmt::Debug) -> Failure {
    let message = format!("saved run: {what}: found {found:?}, expected {expected:?}");
    Failure::new(ErrorKind::BadFile, message)
}

/// Reads the bytes of a `saved` event.
pub fn saved_run(bytes: &[u8]) -> Result<SavedRun<Kept>, Failure> {
    let saved = SavedRun::<Kept>::new(Checkpoint::from_bytes(bytes)?)?;
    let (next, frames) = (saved.frames(), saved.host.frames);
    if next == 0 || next > frames {
        return Err(wrong("next frame", next, 1..=frames));
    }
    Ok(saved)
}

impl Kept {
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

impl OpenRun {
    /// Whether it is time for another state.
    pub fn save_is_due(&self) -> bool {
        self.keep && clock_s() - self.saved_s >= self.save_pause_s
    }

    /// Emits the state of the run, unless there is nothing that opening again would not bring.
    pub async fn save(&mut self) -> Result<(), Failure> {
        let begun_s = clock_s();
        let info = self.feed.info();
        let frames = info.frames;
        let kept = Kept {
            name: info.name.clone(),
            frames,
            camera: info.camera,
            settings: self.settings.clone(),
            figures: self.figures.clone(),
        };
        let Some(checkpoint) = self.run.checkpoint(&kept, &self.page).await? else {
            return Ok(());
        };
        let parts = checkpoint.parts();
        let bytes = Uint8Array::new_with_length(parts.iter().map(|p| p.len() as u32).sum());
        let mut at = 0;
        for part in &parts {
            let end = at + part.len() as u32;
            bytes.subarray(at, end).copy_from(part);
            at = end;
        }
        let frame = self.run.next_frame();
        self.page.emit(&Event::Saved(SavedEvent { frame, frames, bytes: bytes.into() }));
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
        let error = |bytes: &[u8]| saved_run(bytes).err().map(|f| f.0.message);
        assert!(error(b"nothing").is_some_and(|m| m.contains("checkpoint")));
        let plain = Checkpoint::default().to_bytes();
        assert!(error(&plain).is_some_and(|m| m.contains("the state of a run")));
        let mut other = Checkpoint::default();
        other.metadata.insert("run".into(), "{}".into());
        assert!(error(&other.to_bytes()).is_some_and(|m| m.contains("missing field")));
    }
}
