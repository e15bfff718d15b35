//! The complete configuration of a run. Every field has a default; presets change some.
use alloc::{format, string::String};
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
    /// Share of mapping's rays that seek rare classes.
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

impl Default for Config {
    fn default() -> Self {
        Config {
            seed: 1,
            field: FieldConfig::default(),
            sampling: SamplingConfig::default(),
            loss: LossConfig::default(),
            tracking: TrackingConfig::default(),
            mapping: MappingConfig::default(),
            keyframes: KeyframeConfig::default(),
            semantics: SemanticsConfig::default(),
            fusion: FusionConfig::default(),
            suppressor: SuppressorConfig::default(),
            mesh: MeshConfig::default(),
        }
    }
}

impl Default for FieldConfig {
    fn default() -> Self {
        FieldConfig {
            geometry_coarse_m: 0.24,
            geometry_fine_m: 0.04,
            surface_coarse_m: 0.24,
            surface_fine_m: 0.02,
            truncation_m: 0.06,
            sharpness: 20.0,
            use_given_bounds: true,
            margin_m: 0.3,
        }
    }
}

impl Default for SamplingConfig {
    fn default() -> Self {
        SamplingConfig {
            stratified: 32,
            surface: 8,
            render_stratified: 96,
            render_surface: 24,
            near_m: 0.02,
            min_weight: 1e-3,
            rare_share: 0.25,
            semantic_rare_share: 0.05,
            rare_draws: 24,
        }
    }
}

impl Default for LossConfig {
    fn default() -> Self {
        LossConfig {
            free_space: 5.0,
            centre: 200.0,
            tail: 10.0,
            depth: 0.1,
            color: 5.0,
            semantic: 0.1,
            balance: 0.25,
        }
    }
}

impl Default for TrackingConfig {
    fn default() -> Self {
        TrackingConfig {
            tracker: Tracker::Align,
            align_iterations: 6,
            align_pixels: 4096,
            align_field_weight: 1.0,
            align_sigma_distance_m: 0.01,
            align_sigma_intensity: 0.1,
            render_rays: 2000,
            render_iterations: 8,
            render_rate_translation_m: 2e-3,
            render_rate_rotation_rad: 1e-3,
            render_loss: LossConfig {
                free_space: 10.0,
                centre: 200.0,
                tail: 50.0,
                depth: 1.0,
                color: 5.0,
                semantic: 0.0,
                balance: 0.0,
            },
        }
    }
}

impl Default for MappingConfig {
    fn default() -> Self {
        MappingConfig {
            every: 5,
            rays: 4000,
            iterations: 15,
            first_iterations: 200,
            final_iterations: 100,
            semantic_iterations: 1000,
            first_rate_factor: 5.0,
            rate_planes: 5e-3,
            rate_decoders: 1e-3,
            window: 8,
            refine_poses: RefinePoses::Auto,
            rate_translation_m: 5e-4,
            rate_rotation_rad: 5e-4,
            decoder_stride: 8,
            min_gradient: 2e-4,
        }
    }
}

impl Default for KeyframeConfig {
    fn default() -> Self {
        KeyframeConfig { every: 5, budget_mib: 96 }
    }
}

impl Default for SemanticsConfig {
    fn default() -> Self {
        SemanticsConfig { head: Head::Ray }
    }
}

impl Default for FusionConfig {
    fn default() -> Self {
        FusionConfig {
            enabled: true,
            token_pixels: 8,
            key_stride: 2,
            residual: true,
            local: true,
            local_kernel: 1,
            gate_kernel: 1,
            memory: true,
            steps: 1,
            first_steps: 40,
            rate: 1e-2,
            weight_class: 1.0,
            weight_color: 0.5,
            balance: 0.5,
            weight: 0.0,
            final_weight: 0.003,
            final_steps: 200,
            doubt: 0.5,
        }
    }
}

impl Default for SuppressorConfig {
    fn default() -> Self {
        SuppressorConfig {
            enabled: true,
            anchors: 256,
            weight: 0.0,
            final_weight: 0.003,
            start: 1,
            ramp: 10,
            rule: AnchorRule::Mean,
            beta: 0.05,
            memory: 2000.0,
            decay: 0.999,
            spawn_distance: 4.0,
            merge_distance: 2.0,
            spawns: 8,
            stable: 0.05,
            min_importance: 100.0,
            min_age: 40,
            doubt: 1.0,
            settle_share: 0.1,
            inference: Inference::Head,
        }
    }
}

impl Default for MeshConfig {
    fn default() -> Self {
        MeshConfig { resolution_m: 0.02, min_component_triangles: 100 }
    }
}

/// Why a configuration cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("configuration: {field}: found {found}, expected {expected}")]
pub struct ConfigError {
    /// Dotted path of the field.
    pub field: &'static str,
    /// Its value.
    pub found: String,
    /// What it may be.
    pub expected: &'static str,
}

impl Config {
    /// Names of the presets.
    pub const PRESETS: [&'static str; 4] = ["fast", "replica", "scannet", "tum"];

    /// A preset by name.
    pub fn preset(name: &str) -> Option<Config> {
        let mut c = Config::default();
        match name {
            "replica" => {}
            "fast" => {
                c.mapping.rays = 2000;
                c.mapping.iterations = 10;
                c.mapping.first_iterations = 120;
                c.mapping.final_iterations = 40;
                c.sampling.stratified = 20;
                c.tracking.align_pixels = 2048;
            }
            "scannet" => {
                c.tracking.render_iterations = 30;
                c.tracking.render_rate_translation_m = 5e-4;
                c.tracking.render_rate_rotation_rad = 2.5e-3;
                c.mesh.resolution_m = 0.02;
            }
            "tum" => {
                c.tracking.render_iterations = 30;
                c.tracking.render_rate_translation_m = 1e-2;
                c.tracking.render_rate_rotation_rad = 5e-3;
                c.mapping.every = 1;
                c.keyframes.every = 1;
            }
            _ => return None,
        }
        Some(c)
    }

    /// Checks every field that could make a run fail or mislead later.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let check = |ok: bool, field, found: String, expected| {
            if ok { Ok(()) } else { Err(ConfigError { field, found, expected }) }
        };
        let positive = |field, x: f64| {
            check(x.is_finite() && x > 0.0, field, format!("{x}"), "a positive number")
        };
        let not_negative = |field, x: f64| {
            check(x.is_finite() && x >= 0.0, field, format!("{x}"), "a number that is not negative")
        };
        let count = |field, x: u32, max: u32, expected| {
            check(x >= 1 && x <= max, field, format!("{x}"), expected)
        };
        let f = &self.field;
        positive("field.geometry_coarse_m", f.geometry_coarse_m)?;
        positive("field.geometry_fine_m", f.geometry_fine_m)?;
        positive("field.surface_coarse_m", f.surface_coarse_m)?;
        positive("field.surface_fine_m", f.surface_fine_m)?;
        positive("field.truncation_m", f.truncation_m)?;
        positive("field.sharpness", f.sharpness)?;
        not_negative("field.margin_m", f.margin_m)?;
        // Growing the map copies cells: every cell edge must divide the step it grows by.
        for (field, cell) in [
            ("field.geometry_coarse_m", f.geometry_coarse_m),
            ("field.geometry_fine_m", f.geometry_fine_m),
            ("field.surface_fine_m", f.surface_fine_m),
        ] {
            let ratio = f.surface_coarse_m / cell;
            let whole = num_traits::Float::round(ratio).max(1.0);
            check(
                num_traits::Float::abs(ratio - whole) < 1e-6,
                field,
                format!("{cell}"),
                "a whole fraction of field.surface_coarse_m",
            )?;
        }
        let s = &self.sampling;
        count("sampling.stratified", s.stratified, 128, "1 to 128")?;
        count("sampling.surface", s.surface, 64, "1 to 64")?;
        count("sampling.render_stratified", s.render_stratified, 128, "1 to 128")?;
        count("sampling.render_surface", s.render_surface, 64, "1 to 64")?;
        not_negative("sampling.near_m", s.near_m)?;
        not_negative("sampling.min_weight", s.min_weight)?;
        not_negative("sampling.rare_share", s.rare_share)?;
        not_negative("sampling.semantic_rare_share", s.semantic_rare_share)?;
        count("sampling.rare_draws", s.rare_draws, 64, "1 to 64")?;
        for l in [&self.loss, &self.tracking.render_loss] {
            not_negative("loss.free_space", l.free_space)?;
            not_negative("loss.centre", l.centre)?;
            not_negative("loss.tail", l.tail)?;
            not_negative("loss.depth", l.depth)?;
            not_negative("loss.color", l.color)?;
            not_negative("loss.semantic", l.semantic)?;
            not_negative("loss.balance", l.balance)?;
        }
        let t = &self.tracking;
        count("tracking.align_iterations", t.align_iterations.max(1), 1000, "0 to 1000")?;
        count("tracking.align_pixels", t.align_pixels, 1 << 18, "1 to 262144")?;
        positive("tracking.align_sigma_distance_m", t.align_sigma_distance_m)?;
        positive("tracking.align_sigma_intensity", t.align_sigma_intensity)?;
        not_negative("tracking.align_field_weight", t.align_field_weight)?;
        count("tracking.render_rays", t.render_rays, 1 << 15, "1 to 32768")?;
        count("tracking.render_iterations", t.render_iterations, 10_000, "1 to 10000")?;
        positive("tracking.render_rate_translation_m", t.render_rate_translation_m)?;
        positive("tracking.render_rate_rotation_rad", t.render_rate_rotation_rad)?;
        let m = &self.mapping;
        count("mapping.every", m.every, u32::MAX, "at least 1")?;
        count("mapping.rays", m.rays, 1 << 15, "1 to 32768")?;
        count("mapping.window", m.window, 64, "1 to 64")?;
        check(
            m.rays >= m.window,
            "mapping.rays",
            format!("{}", m.rays),
            "at least mapping.window",
        )?;
        count("mapping.iterations", m.iterations, 100_000, "1 to 100000")?;
        count("mapping.first_iterations", m.first_iterations, 100_000, "1 to 100000")?;
        positive("mapping.first_rate_factor", m.first_rate_factor)?;
        positive("mapping.rate_planes", m.rate_planes)?;
        positive("mapping.rate_decoders", m.rate_decoders)?;
        not_negative("mapping.rate_translation_m", m.rate_translation_m)?;
        not_negative("mapping.rate_rotation_rad", m.rate_rotation_rad)?;
        not_negative("mapping.min_gradient", m.min_gradient)?;
        count("mapping.decoder_stride", m.decoder_stride, 1024, "1 to 1024")?;
        count("keyframes.every", self.keyframes.every, u32::MAX, "at least 1")?;
        count("keyframes.budget_mib", self.keyframes.budget_mib, 1 << 16, "1 to 65536")?;
        let f = &self.fusion;
        check(
            [8, 16, 24, 32].contains(&f.token_pixels),
            "fusion.token_pixels",
            format!("{}", f.token_pixels),
            "8, 16, 24 or 32",
        )?;
        count("fusion.key_stride", f.key_stride, 16, "1 to 16")?;
        for (field, edge) in
            [("fusion.local_kernel", f.local_kernel), ("fusion.gate_kernel", f.gate_kernel)]
        {
            check(edge == 1 || edge == 3, field, format!("{edge}"), "1 or 3")?;
        }
        count("fusion.steps", f.steps.max(1), 1000, "0 to 1000")?;
        count("fusion.first_steps", f.first_steps.max(1), 10_000, "0 to 10000")?;
        positive("fusion.rate", f.rate)?;
        not_negative("fusion.weight_class", f.weight_class)?;
        not_negative("fusion.weight_color", f.weight_color)?;
        not_negative("fusion.balance", f.balance)?;
        not_negative("fusion.weight", f.weight)?;
        not_negative("fusion.final_weight", f.final_weight)?;
        not_negative("fusion.doubt", f.doubt)?;
        let a = &self.suppressor;
        count("suppressor.anchors", a.anchors, 256, "1 to 256")?;
        not_negative("suppressor.weight", a.weight)?;
        not_negative("suppressor.final_weight", a.final_weight)?;
        not_negative("suppressor.doubt", a.doubt)?;
        check(
            (0.0..=10.0).contains(&a.settle_share),
            "suppressor.settle_share",
            format!("{}", a.settle_share),
            "0 to 10",
        )?;
        for (field, x) in [("suppressor.beta", a.beta), ("suppressor.decay", a.decay)] {
            check((0.0..=1.0).contains(&x), field, format!("{x}"), "0 to 1")?;
        }
        positive("suppressor.memory", a.memory)?;
        positive("suppressor.spawn_distance", a.spawn_distance)?;
        positive("suppressor.merge_distance", a.merge_distance)?;
        not_negative("suppressor.stable", a.stable)?;
        not_negative("suppressor.min_importance", a.min_importance)?;
        positive("mesh.resolution_m", self.mesh.resolution_m)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid_and_bad_values_are_named() {
        for name in Config::PRESETS {
            Config::preset(name).unwrap().validate().unwrap();
        }
        assert!(Config::preset("nope").is_none());
        let mut c = Config::default();
        c.field.truncation_m = f64::NAN;
        assert_eq!(c.validate().unwrap_err().field, "field.truncation_m");
        c = Config::default();
        c.field.geometry_fine_m = 0.07;
        assert_eq!(c.validate().unwrap_err().field, "field.geometry_fine_m");
    }
}
