//! A map on an engine, without a run around it: what tests of passes and gradients drive.
use crate::fixture::{CLASSES, DEPTH_UNIT_M};
use mte_slam_core::{
    commands::{Buffer, BufferId, Commands},
    config::Config,
    engine::Engine,
    field::FieldShape,
    map::{AnchorCounts, Batch, FrameFormat, Map, Rates, Scratch, fusion, passes, suppressor},
};
use mte_slam_types::{camera::Camera, frame::Frame, pose::Pose};
use pollster::block_on;
use std::ops::Deref;

/// An engine, a map and its scratch buffers. Reads as the map.
pub struct Rig {
    /// The engine.
    pub engine: Engine,
    /// The map.
    pub map: Map,
    /// Its scratch buffers.
    pub scratch: Scratch,
}

impl Deref for Rig {
    type Target = Map;
    fn deref(&self) -> &Map {
        &self.map
    }
}

impl Rig {
    /// A map for frames of the fixture's classes and unit of depth, with feature maps of `channels`
    /// channels (0 for none).
    pub fn new(
        mut engine: Engine,
        config: &Config,
        camera: Camera,
        channels: u32,
        shape: FieldShape,
    ) -> Rig {
        let format = FrameFormat {
            camera,
            depth_unit_m: DEPTH_UNIT_M,
            classes: CLASSES,
            feature_channels: channels,
        };
        let map = Map::new(&mut engine, config, &format, shape).unwrap();
        let scratch = Scratch::new(&mut engine, config, &map).unwrap();
        Rig { engine, map, scratch }
    }

    /// Runs what is recorded.
    pub fn submit(&mut self, r: &Commands) {
        self.engine.submit(r).unwrap();
    }

    /// Floats of a buffer.
    pub fn read(&mut self, buffer: impl Into<BufferId>, floats: usize) -> Vec<f32> {
        block_on(self.engine.read_as(buffer, 0, floats)).unwrap()
    }

    /// Words of a buffer.
    pub fn read_words(&mut self, buffer: impl Into<BufferId>, words: usize) -> Vec<u32> {
        block_on(self.engine.read(buffer, 0, words)).unwrap()
    }

    /// Replaces the beginning of a buffer.
    pub fn write(&mut self, buffer: impl Into<BufferId>, values: &[f32]) {
        let mut r = Commands::new();
        r.upload(buffer, 0, values);
        self.submit(&r);
    }

    /// As [`mte_slam_core::map::FrameSlots::upload_frame`].
    pub fn upload_frame(&self, r: &mut Commands, slot: u32, frame: &Frame) {
        self.map.frames.upload_frame(r, slot, frame);
    }

    /// As [`mte_slam_core::map::FrameSlots::upload_color`].
    pub fn upload_color(&self, r: &mut Commands, slot: u32, image: &[[u8; 4]]) {
        self.map.frames.upload_color(r, slot, image);
    }

    /// As [`mte_slam_core::map::FrameSlots::upload_pose`].
    pub fn upload_pose(&self, r: &mut Commands, slot: u32, pose: &Pose) {
        self.map.frames.upload_pose(r, slot, pose);
    }

    /// As [`Scratch::upload_window`].
    pub fn upload_window(&self, r: &mut Commands, window: &[(u32, bool)]) {
        self.scratch.upload_window(r, window);
    }

    /// As [`passes::record_forward`].
    pub fn record_forward(&self, r: &mut Commands, b: &Batch<'_>) {
        passes::record_forward(r, &self.map, &self.scratch, b);
    }

    /// As [`passes::record_backward`].
    pub fn record_backward(&self, r: &mut Commands, b: &Batch<'_>) {
        passes::record_backward(r, &self.map, &self.scratch, b);
    }

    /// As [`passes::record_pose_step`], with the rates of translation \[m\] and rotation \[rad\].
    pub fn record_pose_step(
        &self,
        r: &mut Commands,
        b: &Batch<'_>,
        rates: [f64; 2],
        restart: bool,
    ) {
        let [translation_m, rotation_rad] = rates;
        let (map, scratch) = (&self.map, &self.scratch);
        passes::record_pose_step(r, map, scratch, b, translation_m, rotation_rad, restart);
    }

    /// As [`passes::record_step`].
    pub fn record_step(&mut self, r: &mut Commands, b: &Batch<'_>, rates: Rates) {
        passes::record_step(r, &mut self.map, &self.scratch, b, rates);
    }

    /// As [`fusion::record_forward`].
    pub fn record_fusion_forward(&self, r: &mut Commands, slot: u32) {
        fusion::record_forward(r, &self.map, &self.scratch, slot);
    }

    /// As [`fusion::record_backward`].
    pub fn record_fusion_backward(&self, r: &mut Commands, slot: u32) {
        fusion::record_backward(r, &self.map, &self.scratch, slot);
    }

    /// As [`fusion::record_step`].
    pub fn record_fusion_step(&mut self, r: &mut Commands, slot: u32, rate_head: f64) {
        fusion::record_step(r, &mut self.map, &self.scratch, slot, rate_head);
    }

    /// As [`suppressor::record_update`].
    pub fn record_anchor_update(&self, r: &mut Commands, b: &Batch<'_>) {
        suppressor::record_update(r, &self.map, &self.scratch, b);
    }

    /// As [`suppressor::record_maintenance`].
    pub fn record_anchor_maintenance(&self, r: &mut Commands, b: &Batch<'_>) {
        suppressor::record_maintenance(r, &self.map, &self.scratch, b);
    }

    /// As [`suppressor::record_settling`].
    pub fn record_anchor_settling(&self, r: &mut Commands, b: &Batch<'_>, rate: f64, begin: bool) {
        suppressor::record_settling(r, &self.map, &self.scratch, b, rate, begin);
    }

    /// As [`Map::read_status`].
    pub fn read_status(&mut self) -> u32 {
        block_on(self.map.read_status(&mut self.engine)).unwrap()
    }

    /// As [`Scratch::read_ray_out`].
    pub fn read_ray_out(&mut self, rays: u32) -> Vec<f32> {
        block_on(self.scratch.read_ray_out(&mut self.engine, rays)).unwrap()
    }

    /// As [`Scratch::read_ray_state`].
    pub fn read_ray_state(&mut self, rays: u32) -> Vec<f32> {
        block_on(self.scratch.read_ray_state(&mut self.engine, rays)).unwrap()
    }

    /// As [`mte_slam_core::map::FrameSlots::read_pose_state`].
    pub fn read_pose_state(&mut self, slot: u32) -> Vec<f32> {
        block_on(self.map.frames.read_pose_state(&mut self.engine, slot)).unwrap()
    }

    /// As [`mte_slam_core::map::FrameSlots::read_poses`].
    pub fn read_poses(&mut self, count: u32) -> Vec<Option<Pose>> {
        block_on(self.map.frames.read_poses(&mut self.engine, count)).unwrap()
    }

    /// As [`suppressor::read_counts`].
    pub fn read_anchor_counts(&mut self) -> Option<AnchorCounts> {
        block_on(suppressor::read_counts(&mut self.engine, &self.map)).unwrap()
    }

    /// Buffer of the fusion's activations, floats per token, number of tokens.
    pub fn tokens(&self) -> (Buffer<f32>, usize, usize) {
        let f = self.map.fusion.as_ref().unwrap();
        (self.scratch.fusion.as_ref().unwrap().tokens, f.stride as usize, f.count())
    }
}
