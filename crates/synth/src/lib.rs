//! The built-in RGB-D sequence: a furnished, textured room, ray-cast as its frames are asked for,
//! with exact poses, labels and a ground-truth mesh. The same seed gives the same bytes.
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

mod bvh;
mod furniture;
mod light;
mod math;
mod mesh;
mod render;
mod scene;
mod sensor;
mod shape;
mod texture;
mod trajectory;

pub use mesh::SyntheticMesh;

use alloc::format;
use mte_slam_types::{
    camera::Camera,
    frame::{Bounds, Frame, SequenceInfo},
    pose::Pose,
    sequence::{Sequence, SequenceError},
};
use scene::Scene;
use serde::{Deserialize, Serialize};

/// Metres per unit of the depth images, as in Replica.
const DEPTH_UNIT_M: f64 = 1.0 / 6553.5;

/// Which scene to build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
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
    /// The demo: 80 frames of the room, 240 x 180, exact depth.
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

/// The built-in sequence. Building it takes a fraction of a second (its light is computed once).
pub struct SyntheticSequence {
    options: SyntheticOptions,
    info: SequenceInfo,
    scene: Scene,
}

impl SyntheticSequence {
    /// Build the scene.
    pub fn new(mut options: SyntheticOptions) -> Self {
        options.width = options.width.clamp(8, 4096);
        options.height = options.height.clamp(8, 4096);
        let scene = Scene::new(options.scene, options.seed);
        let (w, h) = (f64::from(options.width), f64::from(options.height));
        let focal = 0.6 * w;
        let camera = Camera {
            width: options.width,
            height: options.height,
            fx: focal,
            fy: focal,
            cx: 0.5 * (w - 1.0),
            cy: 0.5 * (h - 1.0),
        };
        let (min, max) = scene.room.shell.bounds();
        let info = SequenceInfo {
            feature_channels: 0,
            name: format!("synthetic-{}", options.scene.name()),
            layout: "synthetic",
            camera,
            depth_unit_m: DEPTH_UNIT_M,
            frames: options.frames,
            classes: scene::class_table(),
            bounds: Some(Bounds { min: min.as_dvec3() - 0.1, max: max.as_dvec3() + 0.1 }),
        };
        SyntheticSequence { options, info, scene }
    }

    /// What it was built from (sizes as used).
    pub fn options(&self) -> &SyntheticOptions {
        &self.options
    }

    fn render(&self, index: usize, pose: &Pose, noise: bool) -> Frame {
        let image = render::render(&self.scene, &self.info.camera, pose);
        let depth = if noise {
            sensor::degrade(&image, &self.info.camera, self.options.seed, index)
        } else {
            image.depth_m.iter().map(|&z| sensor::quantise(z)).collect()
        };
        Frame {
            features: None,
            index,
            number: index as u64,
            time_s: self.time_s(index),
            color: image.color,
            depth,
            labels: Some(image.labels),
            truth: Some(*pose),
        }
    }

    /// The scene's visible surfaces as triangles, with classes and colours.
    pub fn ground_truth_mesh(&self) -> SyntheticMesh {
        mesh::build(&self.scene)
    }
}

impl Sequence for SyntheticSequence {
    fn info(&self) -> &SequenceInfo {
        &self.info
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        let frames = self.info.frames;
        let Some(pose) = self.truth(index) else {
            return Err(SequenceError::OutOfRange { index, frames });
        };
        Ok(self.render(index, &pose, self.options.depth_noise))
    }

    /// With exact depth.
    fn view_from(&mut self, index: usize, world_from_camera: &Pose) -> Option<Frame> {
        let buried = self.scene.buried(world_from_camera.translation.as_vec3());
        (!buried).then(|| self.render(index, world_from_camera, false))
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        (index < self.info.frames).then(|| self.scene.path.pose(index))
    }

    /// 30 frames a second.
    fn time_s(&self, index: usize) -> f64 {
        index as f64 / 30.0
    }
}

/// Call `work` with every chunk of `size` elements and its number, in parallel with `threads`.
fn par_chunks<T: Send>(out: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync + Send) {
    #[cfg(feature = "threads")]
    {
        use rayon::prelude::*;
        out.par_chunks_mut(size).enumerate().for_each(|(i, chunk)| work(i, chunk));
    }
    #[cfg(not(feature = "threads"))]
    out.chunks_mut(size).enumerate().for_each(|(i, chunk)| work(i, chunk));
}

#[cfg(test)]
mod tests;
