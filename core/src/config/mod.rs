//! The complete configuration of a run. Each setting is declared once, here or in
//! [`mte_slam_odometry`], with its documentation, unit, default and range; presets change
//! some of the defaults.
mod check;
pub mod guide;
mod presets;
mod semantics;

pub use crate::settings::ConfigError;
pub use semantics::{AnchorRule, FusionConfig, Head, Inference, SemanticsConfig, SuppressorConfig};

use crate::settings::{self, Entry, Value};
use alloc::vec::Vec;
use mte_slam_odometry::OdometryConfig;

mte_slam_types::choices! {
    /// How the camera is tracked against the map.
    pub enum Tracker {
        /// RGB-D alignment to the last frame and keyframes, then Gauss-Newton against the field.
        Align = "align",
        /// The same start, then Adam through volume rendering (the paper's tracker).
        Render = "render",
        /// Ground-truth poses: mapping only.
        Truth = "truth",
    }

    /// When mapping refines the poses of its window, too.
    pub enum RefinePoses {
        /// With the `render` tracker only: `align` starts from poses that are better than Adam's
        /// steps.
        Auto = "auto",
        /// Always, except with true poses.
        On = "on",
        /// Never.
        Off = "off",
    }
}

mte_slam_types::settings! {
    /// Everything that decides a run beside its input.
    pub struct Config {
        /// Seed of every random number.
        seed: u32 = 1;
        /// Scene representation.
        field: FieldConfig = FieldConfig::default();
        /// Samples along rays.
        sampling: SamplingConfig = SamplingConfig::default();
        /// Loss weights of mapping.
        loss: LossConfig = LossConfig::default();
        /// Tracking against the map.
        tracking: TrackingConfig = TrackingConfig::default();
        /// Mapping.
        mapping: MappingConfig = MappingConfig::default();
        /// Keyframes.
        keyframes: KeyframeConfig = KeyframeConfig::default();
        /// Semantics.
        semantics: SemanticsConfig = SemanticsConfig::default();
        /// Multi-tier feature fusion.
        fusion: FusionConfig = FusionConfig::default();
        /// Feature redundancy suppressor.
        suppressor: SuppressorConfig = SuppressorConfig::default();
        /// Meshing.
        mesh: MeshConfig = MeshConfig::default();
        /// RGB-D odometry, from which tracking starts.
        odometry: OdometryConfig = OdometryConfig::default();
    }

    /// Scene representation.
    pub struct FieldConfig {
        /// Cell of the coarse geometry planes; a whole fraction of `surface_coarse_m`.
        geometry_coarse_m: f64["m"] = 0.24, Above(0.0);
        /// Cell of the fine geometry planes; a whole fraction of `surface_coarse_m`.
        geometry_fine_m: f64["m"] = 0.04, Above(0.0);
        /// Cell of the coarse appearance and semantic planes.
        surface_coarse_m: f64["m"] = 0.24, Above(0.0);
        /// Cell of the fine appearance and semantic planes; a whole fraction of `surface_coarse_m`.
        surface_fine_m: f64["m"] = 0.02, Above(0.0);
        /// Truncation of the signed distance.
        truncation_m: f64["m"] = 0.06, Above(0.0);
        /// Sharpness of the interval weights.
        sharpness: f64["1/truncation"] = 20.0, Above(0.0);
        /// Use the dataset's bounds where it gives them; else they are estimated and grown.
        use_given_bounds: bool = true;
        /// Margin around the observed surface when bounds are estimated.
        margin_m: f64["m"] = 0.3, AtLeast(0.0);
    }

    /// Samples along rays.
    pub struct SamplingConfig {
        /// Stratified samples per ray in optimisation.
        stratified: u32 = 32, Between(1.0, 128.0);
        /// Samples around the surface per ray in optimisation.
        surface: u32 = 8, Between(1.0, 64.0);
        /// Stratified samples per ray when rendering views.
        render_stratified: u32 = 96, Between(1.0, 128.0);
        /// Second-round samples per ray when rendering views.
        render_surface: u32 = 24, Between(1.0, 64.0);
        /// Depth of the first sample.
        near_m: f64["m"] = 0.02, AtLeast(0.0);
        /// Intervals lighter than this carry no appearance or semantics.
        min_weight: f64 = 1e-3, Between(0.0, 1.0);
        /// Share of the rays of mapping, and of those that settle anchors, that seek rare classes.
        rare_share: f64 = 0.25, Between(0.0, 1.0);
        /// The same while the semantics are trained alone; wrong labels are rare, too, and there
        /// they would undo what doubting them brings.
        semantic_rare_share: f64 = 0.05, Between(0.0, 1.0);
        /// Pixels that such a ray chooses from: the one whose class was seen least is taken.
        rare_draws: u32 = 24, Between(1.0, 64.0);
    }

    /// Loss weights; all losses are means over rays.
    pub struct LossConfig {
        /// Signed distance in free space (to 1).
        free_space: f64 = 5.0, AtLeast(0.0);
        /// Signed distance within 0.4 truncations of the surface.
        centre: f64["1/m^2"] = 200.0, AtLeast(0.0);
        /// Signed distance in the rest of the truncation band.
        tail: f64["1/m^2"] = 10.0, AtLeast(0.0);
        /// Rendered depth.
        depth: f64["1/m^2"] = 0.1, AtLeast(0.0);
        /// Rendered color.
        color: f64 = 5.0, AtLeast(0.0);
        /// Cross-entropy of the rendered classes.
        semantic: f64 = 0.1, AtLeast(0.0);
        /// Exponent of the inverse frequency that weighs classes in it: 0 as they come, 1
        /// balanced.
        balance: f64 = 0.25, Between(0.0, 4.0);
        /// Share that the loss takes back of how much likelier those weights, and rays that seek
        /// rare classes, make a class (logit adjustment): 0 nothing, 1 all.
        adjustment: f64 = 0.5, Between(0.0, 1.0);
    }

    /// Tracking against the map.
    pub struct TrackingConfig {
        /// Which tracker.
        tracker: Tracker = Tracker::Align;
        /// `align`: Gauss-Newton iterations against the field.
        align_iterations: u32 = 6, Between(0.0, 1000.0);
        /// `align`: most pixels used.
        align_pixels: u32["pixels"] = 4096, Between(1.0, 262_144.0);
        /// `align`: how much the field may weigh against the frame-to-keyframe alignment.
        align_field_weight: f64 = 1.0, AtLeast(0.0);
        /// `align`: expected distance residual.
        align_sigma_distance_m: f64["m"] = 0.01, Above(0.0);
        /// `align`: expected residual of the intensity, which is 0 to 1.
        align_sigma_intensity: f64 = 0.1, AboveUpTo(0.0, 1.0);
        /// `render`: rays per iteration.
        render_rays: u32 = 2000, Between(1.0, 32_768.0);
        /// `render`: iterations.
        render_iterations: u32 = 8, Between(1.0, 10_000.0);
        /// `render`: Adam step of the translation.
        render_rate_translation_m: f64["m"] = 2e-3, Above(0.0);
        /// `render`: Adam step of the rotation.
        render_rate_rotation_rad: f64["rad"] = 1e-3, Above(0.0);
        /// `render`: loss weights.
        render_loss: LossConfig = LossConfig {
            free_space: 10.0,
            centre: 200.0,
            tail: 50.0,
            depth: 1.0,
            color: 5.0,
            semantic: 0.0,
            balance: 0.0,
            adjustment: 0.0,
        };
    }

    /// Mapping.
    pub struct MappingConfig {
        /// Map every n-th frame.
        every: u32["frames"] = 5, AtLeast(1.0);
        /// Rays per iteration; at least `window`.
        rays: u32 = 4000, Between(1.0, 32_768.0);
        /// Iterations per mapped frame.
        iterations: u32 = 15, Between(1.0, 100_000.0);
        /// Iterations on the first frame.
        first_iterations: u32 = 200, Between(1.0, 100_000.0);
        /// Iterations over all keyframes after the last frame.
        final_iterations: u32 = 100, Between(0.0, 100_000.0);
        /// Iterations of the semantics alone after those: a third of the price, and small classes
        /// need them.
        semantic_iterations: u32 = 1000, Between(0.0, 100_000.0);
        /// Learning rates of the first frame are larger by this factor.
        first_rate_factor: f64 = 5.0, Above(0.0);
        /// Adam step of the plane features.
        rate_planes: f64 = 5e-3, Above(0.0);
        /// Adam step of the decoders.
        rate_decoders: f64 = 1e-3, Above(0.0);
        /// Frames that an iteration draws rays from, with the current one.
        window: u32["frames"] = 8, Between(1.0, 64.0);
        /// Refine the poses of the window, too.
        refine_poses: RefinePoses = RefinePoses::Auto;
        /// Adam step of the poses' translation.
        rate_translation_m: f64["m"] = 5e-4, AtLeast(0.0);
        /// Adam step of the poses' rotation.
        rate_rotation_rad: f64["rad"] = 5e-4, AtLeast(0.0);
        /// Only every n-th tile of samples trains the geometry decoder.
        decoder_stride: u32["tiles"] = 8, Between(1.0, 1024.0);
        /// Samples whose gradient at the distance's pre-activation (times the rays) is smaller
        /// than this are left alone.
        min_gradient: f64 = 2e-4, AtLeast(0.0);
    }

    /// Keyframes.
    pub struct KeyframeConfig {
        /// A mapped frame becomes a keyframe at least every n frames.
        every: u32["frames"] = 5, AtLeast(1.0);
        /// Device memory for keyframe images; over it the least useful are dropped.
        budget_mib: u32["MiB"] = 96, Between(1.0, 65_536.0);
    }

    /// Meshing.
    pub struct MeshConfig {
        /// Edge of a marching cube.
        resolution_m: f64["m"] = 0.02, Above(0.0);
        /// Parts with fewer triangles are dropped.
        min_component_triangles: u32 = 100;
    }
}

impl Config {
    /// Sets a setting by its dotted path, such as `mapping.rays`.
    ///
    /// # Errors
    /// See [`settings::set`].
    pub fn set(&mut self, path: &str, value: impl Into<Value>) -> Result<(), ConfigError> {
        settings::set(self, path, value.into())
    }

    /// The value of a setting; `None` where there is none of that path.
    pub fn get(&self, path: &str) -> Option<Value> {
        settings::get(self, path)
    }

    /// Every setting with its value, type, unit and range, in the order of declaration.
    pub fn settings(&self) -> Vec<Entry> {
        settings::list(self)
    }
}

#[cfg(test)]
mod tests;
