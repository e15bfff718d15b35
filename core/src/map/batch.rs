//! What a pass is asked to do: rays, losses, rates.
use crate::{camera::Camera, config::LossConfig, layout::FieldParams};
use bytemuck::{Pod, Zeroable};

/// Fixed-point quanta per unit of gradient and ray. A surface hit by every ray of a batch stays
/// 2^10 below saturation; a residual of 1e-4 still moves several quanta.
pub(super) const QUANTA: [f32; 3] = [262_144.0, 262_144.0, 1_048_576.0];

/// One batch of rays.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// Window frames, each with the same number of rays.
    pub frames: u32,
    /// Rays per frame.
    pub rays_per_frame: u32,
    /// Stratified samples per ray.
    pub stratified: u32,
    /// Samples per ray of the second round, around the surface.
    pub surface: u32,
    /// `FLAG_*`.
    pub flags: u32,
    /// Loss weights.
    pub loss: &'a LossConfig,
    /// Counter for the random numbers.
    pub iteration: u32,
    /// First pixel of a dense batch.
    pub first: u32,
    /// Another camera than the stored frames': dense batches use its size and intrinsics.
    pub camera: Option<&'a Camera>,
    /// Share of the rays that seek rare classes.
    pub rare_share: f64,
    /// What fusion and suppressor say about the rays' semantics.
    pub supervision: SemanticSupervision,
}

impl Batch<'_> {
    /// Rays of all frames.
    pub fn rays(&self) -> u32 {
        self.frames * self.rays_per_frame
    }

    /// Samples per ray.
    pub fn samples(&self) -> u32 {
        self.stratified + self.surface
    }
}

/// How fusion and suppressor supervise a batch's semantics; all zero: not at all.
#[derive(Clone, Copy, Debug, Default)]
pub struct SemanticSupervision {
    /// Weight of the compression loss.
    pub compression: f64,
    /// Weight of the feature loss.
    pub feature: f64,
    /// How fast trust in a label falls with the squared distance of its nearest anchor.
    pub doubt_anchor: f64,
    /// How fast trust in a label falls with its logit at the pixel's fused feature.
    pub doubt_fused: f64,
}

/// How a class counts in the cross-entropy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ClassWeight {
    /// Weight of labels of the class.
    pub weight: f32,
    /// Added to its logit in the loss, and nowhere else.
    pub adjustment: f32,
}

/// Learning rates of one optimisation step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Plane features.
    pub planes: f64,
    /// Decoders.
    pub decoders: f64,
}

/// Makes kernels see through a camera.
pub(super) fn set_camera(p: &mut FieldParams, camera: &Camera) {
    p.width = camera.width;
    p.height = camera.height;
    p.fx = camera.fx as f32;
    p.fy = camera.fy as f32;
    p.cx = camera.cx as f32;
    p.cy = camera.cy as f32;
}
