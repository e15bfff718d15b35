//! The stored frames: images, poses and fused features, by slot.
use crate::{
    camera::Camera,
    classes::UNLABELLED,
    commands::{Buffer, Commands},
    config::{Config, FusionConfig},
    engine::{Engine, EngineError},
    frame::{FeatureMap, Frame, SequenceInfo},
    kernels::pose_step::POSE_STATE_FLOATS,
    layout::TARGET_FLOATS,
    pose::Pose,
};
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Floats of a pose.
const POSE_FLOATS: usize = 12;

/// What all frames of a sequence share, as far as buffers depend on it.
#[derive(Clone, Copy, Debug)]
pub struct FrameFormat {
    /// Camera of the images.
    pub camera: Camera,
    /// Metres per unit of depth.
    pub depth_unit_m: f64,
    /// Number of classes; 0 without labels.
    pub classes: u32,
    /// Channels of the feature maps that the fusion reads in place of label histograms; 0 without.
    pub feature_channels: u32,
}

impl From<&SequenceInfo> for FrameFormat {
    fn from(info: &SequenceInfo) -> FrameFormat {
        FrameFormat {
            camera: info.camera,
            depth_unit_m: info.depth_unit_m,
            classes: info.classes.len() as u32,
            feature_channels: info.feature_channels as u32,
        }
    }
}

/// The grid of tokens over a frame.
#[derive(Clone, Copy, Debug)]
pub struct TokenGrid {
    /// Columns of tokens.
    pub columns: u32,
    /// Rows of tokens.
    pub rows: u32,
    /// Edge of a token \[pixels\].
    pub token_pixels: u32,
}

impl TokenGrid {
    /// The whole tokens of a camera's images; pixels right of and below them belong to none.
    pub fn new(camera: &Camera, config: &FusionConfig) -> TokenGrid {
        let token_pixels = config.token_pixels;
        TokenGrid {
            columns: camera.width / token_pixels,
            rows: camera.height / token_pixels,
            token_pixels,
        }
    }

    /// Tokens of a frame.
    pub fn tokens(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// Floats of one frame's fused features.
    pub(super) fn target_floats(&self) -> usize {
        self.tokens() * TARGET_FLOATS
    }
}

/// Buffers of the stored frames. Every slot holds the images of one frame.
pub struct FrameSlots {
    /// Number of slots.
    pub count: u32,
    camera: Camera,
    /// Feature maps lie on this grid; `None` without fusion.
    grid: Option<TokenGrid>,
    /// Channels of feature maps; 0 without.
    channels: u32,
    /// Rotation row-major, translation.
    pub(super) poses: Buffer<f32>,
    /// Adam's moments of the poses, and the best pose so far.
    pub(super) pose_state: Buffer<f32>,
    /// Colour and label, a byte each.
    pub(super) color_images: Buffer<u32>,
    /// Depth, two pixels per word.
    pub(super) depth_images: Buffer<u32>,
    /// Feature maps on the token grid.
    pub(super) feature_maps: Buffer<f32>,
    /// Fused features of the tokens: what the rays' features are trained to be.
    pub(super) targets: Buffer<[f32; 4]>,
}

impl FrameSlots {
    /// As many slots as `keyframes.budget_mib` has room for, within the engine's limits.
    pub(super) fn new(
        e: &mut Engine,
        config: &Config,
        format: &FrameFormat,
        grid: Option<TokenGrid>,
    ) -> Result<FrameSlots, EngineError> {
        let camera = format.camera;
        let pixels = camera.pixels();
        let targets = grid.map_or(0, |g| g.target_floats());
        let maps = grid.map_or(0, |g| g.tokens()) * format.feature_channels as usize;
        let slot_bytes = pixels * 4 + pixels.div_ceil(2) * 4 + (targets + maps) * 4;
        let by_limit = e.max_buffer_words() / pixels.max(targets).max(maps);
        let count = (config.keyframes.budget_mib as usize * (1 << 20) / slot_bytes)
            .min(by_limit)
            .clamp(4, 1024);
        Ok(FrameSlots {
            count: count as u32,
            camera,
            grid,
            channels: format.feature_channels,
            poses: e.create("poses", count * POSE_FLOATS)?,
            pose_state: e.create("pose state", count * POSE_STATE_FLOATS)?,
            color_images: e.create("color images", count * pixels)?,
            depth_images: e.create("depth images", count * pixels.div_ceil(2))?,
            feature_maps: e.create("feature maps", (count * maps).max(4))?,
            targets: e.create("targets", (count * targets).max(4))?,
        })
    }

    /// Camera of the images.
    pub(super) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Stores a frame's images in a slot, and forgets the pose optimiser's state of the slot's
    /// former frame.
    pub fn upload_frame(&self, r: &mut Commands, slot: u32, frame: &Frame) {
        let pixels = self.camera.pixels();
        let color = color_words(frame);
        let depth: Vec<u32> = frame
            .depth
            .chunks(2)
            .map(|d| u32::from(d[0]) | d.get(1).map_or(0, |x| u32::from(*x) << 16))
            .collect();
        r.upload(self.color_images, slot as usize * pixels, &color);
        r.upload(self.depth_images, slot as usize * pixels.div_ceil(2), &depth);
        r.clear(self.pose_state, slot as usize * POSE_STATE_FLOATS, POSE_STATE_FLOATS);
        if let (Some(grid), Some(map)) = (&self.grid, &frame.features) {
            self.upload_features(r, slot, grid, map);
        }
    }

    fn upload_features(&self, r: &mut Commands, slot: u32, grid: &TokenGrid, map: &FeatureMap) {
        if map.channels != self.channels as usize {
            return;
        }
        let covered =
            |tokens: u32, pixels: u32| (tokens * grid.token_pixels) as f32 / pixels.max(1) as f32;
        let extent =
            [covered(grid.columns, self.camera.width), covered(grid.rows, self.camera.height)];
        let values = map.resampled(grid.columns as usize, grid.rows as usize, extent);
        r.upload(self.feature_maps, slot as usize * values.len(), &values);
    }

    /// Colour and label of a slot's pixels.
    ///
    /// # Errors
    /// Engine failures.
    pub(crate) async fn read_color(
        &self,
        engine: &mut Engine,
        slot: u32,
    ) -> Result<Vec<[u8; 4]>, EngineError> {
        let pixels = self.camera.pixels();
        let words = engine.read(self.color_images, slot as usize * pixels, pixels).await?;
        Ok(words.into_iter().map(u32::to_le_bytes).collect())
    }

    /// Replaces colour and label of a slot's pixels.
    pub fn upload_color(&self, r: &mut Commands, slot: u32, image: &[[u8; 4]]) {
        r.upload(self.color_images, slot as usize * self.camera.pixels(), image);
    }

    /// Sets the pose of a slot.
    pub fn upload_pose(&self, r: &mut Commands, slot: u32, pose: &Pose) {
        r.upload(self.poses, slot as usize * POSE_FLOATS, &pose_words(pose));
    }

    /// Poses of all slots up to `count`; `None` where a number is not finite.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn read_poses(
        &self,
        engine: &mut Engine,
        count: u32,
    ) -> Result<Vec<Option<Pose>>, EngineError> {
        let words: Vec<f32> = engine.read_as(self.poses, 0, count as usize * POSE_FLOATS).await?;
        Ok(words.chunks_exact(POSE_FLOATS).map(pose_from_words).collect())
    }

    /// State of a slot's pose after steps of it.
    ///
    /// # Errors
    /// Engine failures.
    pub async fn read_pose_state(
        &self,
        engine: &mut Engine,
        slot: u32,
    ) -> Result<Vec<f32>, EngineError> {
        let at = slot as usize * POSE_STATE_FLOATS;
        engine.read_as(self.pose_state, at, POSE_STATE_FLOATS).await
    }
}

/// Colour and label of a frame's pixels, as slots hold them.
pub(crate) fn color_words(frame: &Frame) -> Vec<[u8; 4]> {
    let label = |i: usize| frame.labels.as_ref().map_or(UNLABELLED, |l| l[i]);
    frame.color.iter().enumerate().map(|(i, c)| [c[0], c[1], c[2], label(i)]).collect()
}

/// A pose as kernels read it: rotation row-major, translation.
pub fn pose_words(pose: &Pose) -> [f32; POSE_FLOATS] {
    let m = pose.to_row_major();
    [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[3], m[7], m[11]].map(|x| x as f32)
}

/// The inverse of [`pose_words`], orthonormalised; `None` when a number is not finite.
pub(crate) fn pose_from_words(w: &[f32]) -> Option<Pose> {
    let v = |i: usize| f64::from(w[i]);
    let pose = Pose {
        rotation: DMat3::from_cols(
            DVec3::new(v(0), v(3), v(6)),
            DVec3::new(v(1), v(4), v(7)),
            DVec3::new(v(2), v(5), v(8)),
        ),
        translation: DVec3::new(v(9), v(10), v(11)),
    };
    pose.is_finite().then(|| pose.orthonormalised())
}
