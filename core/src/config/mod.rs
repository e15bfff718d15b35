//! The complete configuration of a run. Every field has a default; presets change some.
mod check;
mod defaults;

pub use check::ConfigError;

use serde::{Deserialize, Serialize};

/// How the camera is tracked against the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tracker {
    /// RGB-D alignment to the last frame and keyframes, then Gauss-Newton against the field.
    Align,
    /// The same start, then Adam through volume rendering (the paper's tracker).
    Render,
    /// Ground-truth poses: mapping only.
    Truth,
}

/// When mapping refines the poses of its window, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RefinePoses {
    /// With the `render` tracker only: `align` starts from poses that are better than Adam's steps
    /// (measured: room-11 0.04 cm without, 0.13 cm with).
    Auto,
    /// Always, but with true poses.
    On,
    /// Never.
    Off,
}

/// Everything that decides a run beside its input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Seed of every random number.
    pub seed: u32,
    /// Scene representation.
    pub field: FieldConfig,
    /// Samples along rays.
    pub sampling: SamplingConfig,
    /// Loss weights.
    pub loss: LossConfig,
    /// Tracking.
    pub tracking: TrackingConfig,
    /// Mapping.
    pub mapping: MappingConfig,
    /// Keyframes.
    pub keyframes: KeyframeConfig,
    /// Semantics.
    pub semantics: SemanticsConfig,
    /// Multi-tier feature fusion.
    pub fusion: FusionConfig,
    /// Feature redundancy suppressor.
    pub suppressor: SuppressorConfig,
    /// Meshing.
    pub mesh: MeshConfig,
}

/// Scene representation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FieldConfig {
    /// Cell of the coarse geometry planes \[m\].
    pub geometry_coarse_m: f64,
    /// Cell of the fine geometry planes \[m\]; divides the coarse cell.
    pub geometry_fine_m: f64,
    /// Cell of the coarse appearance and semantic planes \[m\].
    pub surface_coarse_m: f64,
    /// Cell of the fine appearance and semantic planes \[m\]; divides the coarse cell.
    pub surface_fine_m: f64,
    /// Truncation of the signed distance \[m\].
    pub truncation_m: f64,
    /// Sharpness of the interval weights \[1/truncation\].
    pub sharpness: f64,
    /// Use the data set's bounds where it gives them; else they are estimated and grown.
    pub use_given_bounds: bool,
    /// Margin around the observed surface when bounds are estimated \[m\].
    pub margin_m: f64,
}

/// Samples along rays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SamplingConfig {
    /// Stratified samples a ray in optimisation.
    pub stratified: u32,
    /// Samples around the surface a ray in optimisation.
    pub surface: u32,
    /// Stratified samples a ray when rendering views.
    pub render_stratified: u32,
    /// Second-round samples a ray when rendering views.
    pub render_surface: u32,
    /// Depth of the first sample \[m\].
    pub near_m: f64,
    /// Intervals lighter than this carry no appearance or semantics.
    pub min_weight: f64,
    /// Share of the rays of mapping, and of those that settle anchors, that seek rare classes.
    pub rare_share: f64,
    /// The same while the semantics are trained alone; wrong labels are rare, too, and there they
    /// would undo what doubting them brings.
    pub semantic_rare_share: f64,
    /// Pixels that such a ray chooses from: the one whose class was seen least is taken.
    pub rare_draws: u32,
}

/// Loss weights; all losses are means over rays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossConfig {
    /// Signed distance in free space (to 1).
    pub free_space: f64,
    /// Signed distance within 0.4 truncations of the surface \[1/m^2\].
    pub centre: f64,
    /// Signed distance in the rest of the truncation band \[1/m^2\].
    pub tail: f64,
    /// Rendered depth \[1/m^2\].
    pub depth: f64,
    /// Rendered colour.
    pub color: f64,
    /// Cross-entropy of the rendered classes.
    pub semantic: f64,
    /// Exponent of the inverse frequency that weighs classes in it: 0 as they come, 1 balanced.
    pub balance: f64,
    /// Share that the loss takes back of how much likelier those weights, and rays that seek rare
    /// classes, make a class (logit adjustment): 0 nothing, 1 all.
    pub adjustment: f64,
}

/// Tracking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackingConfig {
    /// Which tracker.
    pub tracker: Tracker,
    /// `align`: Gauss-Newton iterations against the field.
    pub align_iterations: u32,
    /// `align`: most pixels used.
    pub align_pixels: u32,
    /// `align`: how much the field may weigh against the frame-to-keyframe alignment.
    pub align_field_weight: f64,
    /// `align`: expected distance residual \[m\].
    pub align_sigma_distance_m: f64,
    /// `align`: expected intensity residual in 0..1.
    pub align_sigma_intensity: f64,
    /// `render`: rays an iteration.
    pub render_rays: u32,
    /// `render`: iterations.
    pub render_iterations: u32,
    /// `render`: Adam step of the translation \[m\].
    pub render_rate_translation_m: f64,
    /// `render`: Adam step of the rotation \[rad\].
    pub render_rate_rotation_rad: f64,
    /// `render`: loss weights.
    pub render_loss: LossConfig,
}

/// Mapping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MappingConfig {
    /// Map every n-th frame.
    pub every: u32,
    /// Rays an iteration.
    pub rays: u32,
    /// Iterations a call.
    pub iterations: u32,
    /// Iterations on the first frame.
    pub first_iterations: u32,
    /// Iterations over all keyframes after the last frame.
    pub final_iterations: u32,
    /// Iterations of the semantics alone after those: a third of the price, and small classes need
    /// them.
    pub semantic_iterations: u32,
    /// Learning rates of the first frame are this much larger.
    pub first_rate_factor: f64,
    /// Adam step of the plane features.
    pub rate_planes: f64,
    /// Adam step of the decoders.
    pub rate_decoders: f64,
    /// Frames an iteration draws rays from (with the current one).
    pub window: u32,
    /// Refine the poses of the window, too.
    pub refine_poses: RefinePoses,
    /// Adam step of the poses' translation \[m\].
    pub rate_translation_m: f64,
    /// Adam step of the poses' rotation \[rad\].
    pub rate_rotation_rad: f64,
    /// Only every n-th tile of samples trains the geometry decoder.
    pub decoder_stride: u32,
    /// Samples whose gradient at the distance's pre-activation (times the rays) is smaller than
    /// this are left alone.
    pub min_gradient: f64,
}

/// Keyframes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KeyframeConfig {
    /// A mapped frame becomes a keyframe at least every n frames.
    pub every: u32,
    /// Device memory for keyframe images \[MiB\]; over it the least useful are dropped.
    pub budget_mib: u32,
}

/// Multi-tier feature fusion (paper III-A). Without labels it is off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FusionConfig {
    /// Use it.
    pub enabled: bool,
    /// Edge of a token \[pixels\]: 8, 16, 24 or 32.
    pub token_pixels: u32,
    /// Every n-th column and row of tokens is a key of the attention.
    pub key_stride: u32,
    /// Add a token's own appearance to what attention gives in the second stage.
    pub residual: bool,
    /// Local module: depthwise convolution before the pointwise one.
    pub local: bool,
    /// Edge of the pointwise convolution: 1, or 3 as the paper writes.
    pub local_kernel: u32,
    /// Edge of the gate's convolution: 1 or 3.
    pub gate_kernel: u32,
    /// Give the fusion the map's own semantic feature at each token's point.
    pub memory: bool,
    /// Training steps a mapping call, about half of them on earlier frames.
    pub steps: u32,
    /// Training steps on the first frame.
    pub first_steps: u32,
    /// Adam step.
    pub rate: f64,
    /// Weight of the cross-entropy at the fused features.
    pub weight_class: f64,
    /// Weight of the colour loss at the fused features.
    pub weight_color: f64,
    /// Exponent of the inverse frequency that weighs classes: 0 as they come, 1 balanced.
    pub balance: f64,
    /// Weight of the feature loss: rays against the fused feature of their pixel.
    pub weight: f64,
    /// The same while the semantics are trained alone, at the end.
    pub final_weight: f64,
    /// Training steps in that stage, spread over its iterations.
    pub final_steps: u32,
    /// In that stage: how fast trust in a label falls with its logit below the best one at the
    /// fused feature of the pixel; 0: every label is believed.
    pub doubt: f64,
}

/// How anchors follow their features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AnchorRule {
    /// Moving average with a fixed rate (paper eq. 11).
    Average,
    /// Running mean (paper eq. 12).
    Mean,
}

/// What gives a pixel or a vertex its class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inference {
    /// The class head.
    Head,
    /// The nearest anchor, once the last optimisation is complete and anchors have settled; before
    /// that, and without a suppressor, the class head.
    Anchors,
}

/// Feature redundancy suppressor (paper III-B). Without labels it is off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SuppressorConfig {
    /// Use it.
    pub enabled: bool,
    /// Most anchors, 1 to 256.
    pub anchors: u32,
    /// Weight of the compression loss once it is on in full.
    pub weight: f64,
    /// The same while the semantics are trained alone, at the end.
    pub final_weight: f64,
    /// Mapping calls before the compression loss begins.
    pub start: u32,
    /// Mapping calls over which it rises.
    pub ramp: u32,
    /// How anchors follow their features.
    pub rule: AnchorRule,
    /// Rate of the moving average.
    pub beta: f64,
    /// Matches that the running mean remembers at most.
    pub memory: f64,
    /// What importance and votes keep at each update.
    pub decay: f64,
    /// A feature this far from every anchor of its class spawns one.
    pub spawn_distance: f64,
    /// Anchors of a class closer than this merge.
    pub merge_distance: f64,
    /// Anchors spawned at most a maintenance.
    pub spawns: u32,
    /// Anchors merge once they move less than this an update.
    pub stable: f64,
    /// Less important anchors (matches, decayed) are dropped.
    pub min_importance: f64,
    /// Updates before an anchor may be dropped or merged.
    pub min_age: u32,
    /// While the semantics are trained alone: how fast trust in a label falls with the (squared)
    /// distance of its class's nearest anchor beyond that of the nearest one; 0: every label is
    /// believed.
    pub doubt: f64,
    /// Iterations that settle the anchors by the head's classes at the very end, as a share of
    /// `mapping.semantic_iterations`; nothing but the anchors changes.
    pub settle_share: f64,
    /// What gives a rendered pixel its class.
    pub inference: Inference,
}

/// Where a pixel's class comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Head {
    /// Features are composited and decoded once a ray.
    Ray,
    /// A perceptron 32-256-256-256-C runs on every sample, and its logits are composited (SNI-SLAM):
    /// a baseline to compare with. Fusion and suppressor work on features of rays; with it they
    /// are off.
    Sample,
}

/// Semantics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SemanticsConfig {
    /// What turns semantic features into classes.
    pub head: Head,
}

/// Meshing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeshConfig {
    /// Edge of a marching cube \[m\].
    pub resolution_m: f64,
    /// Parts with fewer triangles are dropped.
    pub min_component_triangles: u32,
}
