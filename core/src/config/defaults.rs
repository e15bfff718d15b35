//! Defaults and presets.
use super::{
    AnchorRule, Config, FieldConfig, FusionConfig, Head, Inference, KeyframeConfig, LossConfig,
    MappingConfig, MeshConfig, RefinePoses, SamplingConfig, SemanticsConfig, SuppressorConfig,
    Tracker, TrackingConfig,
};

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
            adjustment: 0.5,
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
                adjustment: 0.0,
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
            settle_share: 0.3,
            inference: Inference::Head,
        }
    }
}

impl Default for MeshConfig {
    fn default() -> Self {
        MeshConfig { resolution_m: 0.02, min_component_triangles: 100 }
    }
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
}
