//! The sequence: frames are rendered as they are asked for.
use super::{
    classes, mesh, mesh::SyntheticMesh, options::SyntheticOptions, render, scene::Scene, sensor,
};
use alloc::{format, vec::Vec};
use mte_slam_types::{
    camera::Camera,
    frame::{Bounds, Frame, SequenceInfo},
    pose::Pose,
    sequence::{Sequence, SequenceError},
};

/// The built-in sequence. Building it takes a fraction of a second (its light is computed once).
pub struct SyntheticSequence {
    options: SyntheticOptions,
    info: SequenceInfo,
    pub(super) scene: Scene,
}

/// Returns the time stamp of a frame at 30 frames per second \[s\].
pub fn time_s(index: usize) -> f64 {
    index as f64 / 30.0
}

fn to_frame(image: render::Image, depth: Vec<u16>, index: usize, pose: &Pose) -> Frame {
    Frame {
        features: None,
        index,
        number: index as u64,
        time_s: time_s(index),
        color: image.color,
        depth,
        labels: Some(image.labels),
        truth: Some(*pose),
    }
}

/// Renders a frame with exact depth.
pub fn exact(scene: &Scene, camera: &Camera, index: usize, pose: &Pose) -> Frame {
    let image = render::render(scene, camera, pose);
    let depth = image.depth_m.iter().map(|&z| sensor::quantise(z)).collect();
    to_frame(image, depth, index, pose)
}

impl SyntheticSequence {
    /// Builds the scene.
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
        let (min, max) = scene.shell.bounds();
        let info = SequenceInfo {
            feature_channels: 0,
            name: format!("synthetic-{}", options.scene.name()),
            layout: "synthetic",
            camera,
            depth_unit_m: sensor::DEPTH_UNIT_M,
            frames: options.frames,
            classes: classes::class_table(),
            bounds: Some(Bounds { min: min.as_dvec3() - 0.1, max: max.as_dvec3() + 0.1 }),
        };
        SyntheticSequence { options, info, scene }
    }

    /// Returns what it was built from (sizes as used).
    pub fn options(&self) -> &SyntheticOptions {
        &self.options
    }

    fn render(&self, index: usize, pose: &Pose, noise: bool) -> Frame {
        let camera = &self.info.camera;
        if !noise {
            return exact(&self.scene, camera, index, pose);
        }
        let image = render::render(&self.scene, camera, pose);
        let depth = sensor::degrade(&image, camera, self.options.seed, index);
        to_frame(image, depth, index, pose)
    }

    /// Returns the scene's visible surfaces as triangles, with classes and colours.
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

    /// 30 frames per second.
    fn time_s(&self, index: usize) -> f64 {
        time_s(index)
    }
}
