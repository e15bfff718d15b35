//! What a configuration must hold to make sense.
use super::Config;
use alloc::{format, string::String};

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
            not_negative("loss.adjustment", l.adjustment)?;
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
