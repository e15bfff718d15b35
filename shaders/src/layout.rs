//! Layouts and constants that shaders and twins share.
use crate::decoders;

/// Floats of the geometry decoder in the decoder buffer.
pub const GEOMETRY_FLOATS: usize = decoders::COLOR[0].weights;
/// Floats of the color and semantic decoders, behind the geometry decoder.
pub const SURFACE_FLOATS: usize = decoders::END - GEOMETRY_FLOATS;
/// First float of the class head.
pub const HEAD_FLOATS: usize = decoders::END;
/// Most stratified samples per ray.
pub const MAX_STRATIFIED: u32 = 128;
/// Samples an invocation of geometry_backward goes through.
pub const BACKWARD_STRIP: u32 = 8;
/// Floats a cell of a plane holds.
pub const CHANNELS: usize = 16;
/// Floats a ray keeps between the forward and the backward pass.
pub const RAY_STATE_FLOATS: usize = STATE_END as usize * 4;
/// Floats a ray has in `ray_out`.
pub const RAY_OUT_FLOATS: usize = 12;

// Offsets inside a ray's state, in vec4.
/// Composited appearance features (8).
pub const STATE_APPEARANCE: u32 = 0;
/// Composited semantic features (8).
pub const STATE_SEMANTIC: u32 = 8;
/// Hidden activations of the color decoder (8).
pub const STATE_COLOR_HIDDEN: u32 = 16;
/// Hidden activations of the semantic decoder (8).
pub const STATE_SEMANTIC_HIDDEN: u32 = 24;
/// Semantic feature (4).
pub const STATE_FEATURE: u32 = 32;
/// Gradient at the color's pre-activation (1).
pub const STATE_COLOR_DELTA: u32 = 36;
/// Gradient at the semantic feature (4).
pub const STATE_FEATURE_DELTA: u32 = 37;
/// Gradient at the color decoder's hidden layer (8).
pub const STATE_COLOR_HIDDEN_DELTA: u32 = 41;
/// Gradient at the semantic decoder's hidden layer (8).
pub const STATE_SEMANTIC_HIDDEN_DELTA: u32 = 49;
/// Gradient at the composited appearance features (8).
pub const STATE_APPEARANCE_GRADIENT: u32 = 57;
/// Gradient at the composited semantic features (8).
pub const STATE_SEMANTIC_GRADIENT: u32 = 65;
/// Depth \[m\], opacity, gradient at the depth, range of intervals that count: 256 first + end (1).
pub const STATE_DEPTH: u32 = 73;
/// Pose gradient: translation, rotation (2).
pub const STATE_POSE: u32 = 74;
/// Nearest anchor (bits, [`NO_ANCHOR`] without one), its squared distance, the squared distance to
/// the nearest anchor of the ray's own class, weighted loss against anchor and fused feature (1).
pub const STATE_ANCHOR: u32 = 76;
/// Size in vec4.
pub const STATE_END: u32 = 77;

/// Channels of a semantic feature, an anchor, and the attention.
pub const FEATURE: usize = 16;
/// Floats of an anchor: vector (16) | class (bits, 255 for a free slot), matches, importance,
/// temporal variation | age \[updates\], 0, 0, 0.
pub const ANCHOR_FLOATS: usize = 24;
/// No anchor.
pub const NO_ANCHOR: u32 = 0xffff;
/// Floats of a token's fused feature as the rays' target: feature (16) | weight, largest logit, 0, 0.
pub const TARGET_FLOATS: usize = 20;
/// Squared distance to an anchor that does not exist.
pub const NO_DISTANCE: f32 = 1e30;

shared_struct! {
    /// Parameters of all ray and field kernels.
    pub struct FieldParams {
        /// Image width \[pixels\].
        width: u32,
        /// Image height \[pixels\].
        height: u32,
        /// Rays (or points) of the batch.
        rays: u32,
        /// Samples per ray.
        samples: u32,
        /// Focal length \[pixels\].
        fx: f32,
        /// Focal length \[pixels\].
        fy: f32,
        /// Principal point \[pixels\].
        cx: f32,
        /// Principal point \[pixels\].
        cy: f32,
        /// Metres per unit of the depth image.
        depth_unit: f32,
        /// Truncation \[m\].
        truncation: f32,
        /// Sharpness of the interval weights \[1/truncation\].
        sharpness: f32,
        /// Depth of the first sample \[m\].
        near: f32,
        /// Seed of the run.
        seed: u32,
        /// Counter of batches.
        iteration: u32,
        /// `FLAG_*`.
        flags: u32,
        /// Rays of each window frame.
        rays_per_frame: u32,
        /// Stratified samples per ray.
        stratified: u32,
        /// Samples near the surface.
        surface_samples: u32,
        /// Classes, 0 without semantics.
        classes: u32,
        /// First pixel of a dense batch.
        first: u32,
        /// Smallest corner of the map \[m\].
        box_min: [f32; 4],
        /// Largest corner of the map \[m\].
        box_max: [f32; 4],
        /// nx, ny, nz, first cell.
        geometry_coarse: [u32; 4],
        /// nx, ny, nz, first cell.
        geometry_fine: [u32; 4],
        /// nx, ny, nz, first cell.
        surface_coarse: [u32; 4],
        /// nx, ny, nz, first cell.
        surface_fine: [u32; 4],
        /// 1 / cell, coarse and fine \[1/m\].
        geometry_inv_cell: [f32; 4],
        /// 1 / cell, coarse and fine \[1/m\].
        surface_inv_cell: [f32; 4],
        /// Weight of the free-space loss.
        weight_free: f32,
        /// Weight of the distance loss near the surface.
        weight_centre: f32,
        /// Weight of the distance loss in the rest of the truncation band.
        weight_tail: f32,
        /// Weight of the depth loss.
        weight_depth: f32,
        /// Weight of the color loss.
        weight_color: f32,
        /// Weight of the cross-entropy.
        weight_semantic: f32,
        /// Intervals lighter than this carry no appearance or semantics.
        min_weight: f32,
        /// Only every n-th tile of samples trains the geometry decoder.
        decoder_stride: u32,
        /// Quanta per unit of gradient, geometry planes.
        scale_geometry: f32,
        /// Quanta per unit of gradient, appearance planes.
        scale_appearance: f32,
        /// Quanta per unit of gradient, semantic planes.
        scale_semantic: f32,
        /// Largest single contribution in quanta.
        contribution_limit: f32,
        /// align_points: 1 / sigma of the distance residual \[1/m\].
        inv_sigma_distance: f32,
        /// align_points: 1 / sigma of the intensity residual.
        inv_sigma_intensity: f32,
        /// align_points: scale of the robust weight on distances \[m\].
        robust_distance: f32,
        /// align_points: scale of the robust weight on intensities.
        robust_intensity: f32,
        /// Gradients at a sample's pre-activation below this (times the rays) are dropped.
        min_gradient: f32,
        /// Weight of the compression loss.
        weight_compression: f32,
        /// Weight of the feature loss.
        weight_feature: f32,
        /// Slots of anchors that may be in use; 0 without suppressor.
        anchors: u32,
        /// Token columns of an image; 0 without fusion.
        token_columns: u32,
        /// Token rows of an image.
        token_rows: u32,
        /// Edge of a token \[pixels\].
        token_size: u32,
        /// Floats a token's raw inputs take.
        raw_stride: u32,
        /// How fast trust in a label falls with the squared distance of its nearest anchor.
        doubt_anchor: f32,
        /// How fast trust in a label falls with its logit at the pixel's fused feature.
        doubt_fused: f32,
        /// Samples of a ray that the per-sample head sees: all, or in views the first few that carry weight.
        slots: u32,
        /// Share of the drawn rays whose pixel is the rarest in class of `rare_draws` candidates.
        rare_share: f32,
        /// Candidates of such a ray.
        rare_draws: u32,
    }
}
