//! What to generate.
use serde::{Deserialize, Serialize};

/// Which scene to build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum SceneKind {
    /// A living room of 5 x 4.5 x 2.6 m.
    #[default]
    Room,
    /// An office of 5.4 x 4.4 x 2.7 m.
    Office,
    /// A hall of 10 x 9 x 8 m with a gallery: large enough to show what a scene costs in memory.
    #[cfg(feature = "hall")]
    Hall,
}

impl SceneKind {
    /// Its name, as files and command lines have it.
    pub fn name(self) -> &'static str {
        match self {
            SceneKind::Room => "room",
            SceneKind::Office => "office",
            #[cfg(feature = "hall")]
            SceneKind::Hall => "hall",
        }
    }
}

/// What to generate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SyntheticOptions {
    /// Image width \[pixels\], brought into 8..=4096.
    pub width: u32,
    /// Image height \[pixels\], brought into 8..=4096.
    pub height: u32,
    /// Number of frames; a longer sequence begins with the shorter one. The path closes after
    /// about 290 frames and is then walked again.
    pub frames: usize,
    /// Changes colours, patterns, small things and the shake of the hand; not the layout.
    pub seed: u64,
    /// The scene.
    pub scene: SceneKind,
    /// Noise, quantisation and holes as of a Kinect, instead of exact depth.
    pub depth_noise: bool,
}

impl Default for SyntheticOptions {
    /// Returns the demo: 80 frames of the room, 240 x 180, exact depth.
    fn default() -> Self {
        SyntheticOptions {
            width: 240,
            height: 180,
            frames: 80,
            seed: 0,
            scene: SceneKind::Room,
            depth_noise: false,
        }
    }
}

impl SyntheticOptions {
    /// A tiny sequence for tests: 12 frames, 80 x 60.
    pub fn tiny() -> Self {
        SyntheticOptions { width: 80, height: 60, frames: 12, ..Self::default() }
    }
}
