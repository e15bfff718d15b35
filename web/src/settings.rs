//! How a recording is processed: a preset, what differs from it, and what the page shows.
use mte_slam_core::config::Config;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use tsify::Tsify;

/// Names of the presets: those of the core, and `tiny` for processors and quick looks.
pub const PRESETS: [&str; 5] = ["tiny", "fast", "replica", "scannet", "tum"];

/// What differs from the preset `fast` in `tiny`.
const TINY: [(&str, u32); 7] = [
    ("mapping.rays", 600),
    ("mapping.iterations", 6),
    ("mapping.first_iterations", 60),
    ("mapping.final_iterations", 20),
    ("mapping.semantic_iterations", 120),
    ("tracking.align_pixels", 1024),
    ("sampling.stratified", 16),
];

/// Which engine computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Tsify)]
#[serde(rename_all = "lowercase")]
pub enum EngineChoice {
    /// WebGPU if there is any, else the processor, with a warning.
    #[default]
    Auto,
    /// WebGPU or an error.
    Gpu,
    /// The kernels' Rust twins in WebAssembly: slow, but runs everywhere.
    Cpu,
}

/// Where labels come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Tsify)]
#[serde(rename_all = "lowercase")]
pub enum LabelChoice {
    /// The recording's own, if it has any.
    #[default]
    Dataset,
    /// None: geometry and colour only.
    None,
}

/// How a recording is processed. Everything has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Tsify)]
#[serde(rename_all = "camelCase", default, deny_unknown_fields)]
pub struct Settings {
    /// One of [`PRESETS`].
    #[tsify(optional)]
    pub preset: String,
    /// Which engine computes.
    #[tsify(optional)]
    pub engine: EngineChoice,
    /// `align`, `render` or `truth`; the preset's by default.
    #[tsify(optional)]
    pub tracker: Option<String>,
    /// Where labels come from.
    #[tsify(optional)]
    pub labels: LabelChoice,
    /// First frame.
    #[tsify(optional)]
    pub start: usize,
    /// Every how manieth frame is used.
    #[tsify(optional)]
    pub stride: usize,
    /// At most so many frames.
    #[tsify(optional)]
    pub frames: Option<usize>,
    /// Images are made smaller by this factor, in (0, 1].
    #[tsify(optional)]
    pub scale: f64,
    /// Edge of a marching cube of the mesh that is shown while it grows \[m\].
    #[tsify(optional)]
    pub live_resolution_m: f64,
    /// The map is rendered at every so manieth frame; 0 for never.
    #[tsify(optional)]
    pub render_every: usize,
    /// Width of those views \[pixels\].
    #[tsify(optional)]
    pub render_width: u32,
    /// Single values of the configuration by dotted path, such as `mapping.rays`.
    #[tsify(optional, type = "Record<string, number | string | boolean>")]
    pub overrides: BTreeMap<String, Value>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            preset: "fast".into(),
            engine: EngineChoice::Auto,
            tracker: None,
            labels: LabelChoice::Dataset,
            start: 0,
            stride: 1,
            frames: None,
            scale: 1.0,
            live_resolution_m: 0.05,
            render_every: 5,
            render_width: 160,
            overrides: BTreeMap::new(),
        }
    }
}

/// A setting that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingsError(pub String);

impl Settings {
    /// The configuration that the preset and the overrides give.
    ///
    /// # Errors
    /// Names the setting, what was found and what is expected.
    pub fn config(&self) -> Result<Config, SettingsError> {
        let tiny = self.preset == "tiny";
        let base = if tiny { "fast" } else { self.preset.as_str() };
        let Some(preset) = Config::preset(base) else {
            let (found, names) = (&self.preset, PRESETS.join(", "));
            return wrong("preset", found, &format!("one of {names}"));
        };
        let positive = |name: &str, x: f64, max: f64| match x.is_finite() && x > 0.0 && x <= max {
            true => Ok(()),
            false => wrong(name, x, &format!("a number above 0, at most {max}")),
        };
        positive("liveResolutionM", self.live_resolution_m, 1.0)?;
        positive("scale", self.scale, 1.0)?;
        if !(8..=1280).contains(&self.render_width) {
            return wrong("renderWidth", self.render_width, "8 to 1280");
        }
        let failed = |e: serde_json::Error| SettingsError(format!("settings: {e}"));
        let mut config = serde_json::to_value(&preset).map_err(failed)?;
        for (path, value) in TINY.iter().filter(|_| tiny) {
            set(&mut config, path, Value::from(*value))?;
        }
        if let Some(tracker) = &self.tracker {
            set(&mut config, "tracking.tracker", Value::from(tracker.as_str()))?;
        }
        for (path, value) in &self.overrides {
            set(&mut config, path, value.clone())?;
        }
        let config: Config = serde_json::from_value(config).map_err(failed)?;
        config.validate().map_err(|e| SettingsError(e.to_string()))?;
        Ok(config)
    }
}

fn wrong<T>(name: &str, found: impl ToString, expected: &str) -> Result<T, SettingsError> {
    let found = found.to_string();
    Err(SettingsError(format!("settings: {name}: found {found}, expected {expected}")))
}

/// Replaces a value that is there by one of the same type.
fn set(config: &mut Value, path: &str, value: Value) -> Result<(), SettingsError> {
    let pointer = format!("/{}", path.replace('.', "/"));
    let Some(old) = config.pointer_mut(&pointer) else {
        return wrong(path, "no such setting", "a key of the configuration such as mapping.rays");
    };
    let same = match (&*old, &value) {
        // A whole number stays whole; anything may go where a fraction may.
        (Value::Number(a), Value::Number(b)) => a.is_f64() || !b.is_f64(),
        (Value::String(_), Value::String(_)) | (Value::Bool(_), Value::Bool(_)) => true,
        _ => false,
    };
    if !same {
        return wrong(path, &value, &format!("a value like {old}"));
    }
    *old = value;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(path: &str, value: Value) -> Result<Config, SettingsError> {
        let overrides = [(path.to_owned(), value)].into();
        Settings { overrides, ..Settings::default() }.config()
    }

    #[test]
    fn every_preset_is_one_of_the_core_or_tiny() {
        for preset in PRESETS {
            let config = Settings { preset: preset.into(), ..Settings::default() }.config();
            assert_eq!(config.unwrap() == Config::preset("fast").unwrap(), preset == "fast");
        }
        for core in Config::PRESETS {
            assert!(PRESETS.contains(&core), "{core} cannot be chosen on the page");
        }
    }

    #[test]
    fn single_values_are_set_and_mistakes_named() {
        assert_eq!(with("mapping.rays", 500.into()).unwrap().mapping.rays, 500);
        assert_eq!(with("loss.color", 2.into()).unwrap().loss.color, 2.0);
        for (path, value, part) in [
            ("mapping.rayz", 500.into(), "mapping.rayz"),
            ("mapping", 500.into(), "mapping"),
            ("mapping.rays", 1.5.into(), "1.5"),
            ("mapping.rays", 0.into(), "mapping.rays"),
            ("mapping.rays", "many".into(), "many"),
            ("tracking.tracker", "laser".into(), "laser"),
        ] {
            let error = with(path, value).unwrap_err().0;
            assert!(error.contains(part), "{error}");
        }
        let unknown = Settings { preset: "fats".into(), ..Settings::default() }.config();
        assert!(unknown.unwrap_err().0.contains("fats"));
        let coarse = Settings { live_resolution_m: f64::NAN, ..Settings::default() };
        assert!(coarse.config().unwrap_err().0.contains("NaN"));
    }
}
