//! A run's state, kept now and then, so that a lost device, a crash or a reload costs a few frames:
//! the run's checkpoint, with what this crate adds to it.
use crate::{failure::Failure, message::*, settings::Settings};
use mte_slam_core::slam::Checkpoint;
use mte_slam_run::SavedRun;
use mte_slam_types::{camera::Camera, frame::SequenceInfo};
use serde::{Deserialize, Serialize};

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
