//! How a recording is processed: a preset, what differs from it, and what the page shows.
use mte_slam_core::{
    config::{Config, ConfigError},
    settings::Value,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use tsify::Tsify;
use wasm_bindgen::prelude::wasm_bindgen;

/// `Preset` and `Overrides`, made of the core's settings; not part of the module itself.
#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("settings.d.ts");

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
    /// One of [`Config::PRESETS`].
    #[tsify(optional, type = "Preset")]
    pub preset: String,
    /// Which engine computes.
    #[tsify(optional)]
    pub engine: EngineChoice,
    /// `align`, `render` or `truth`; the preset's by default.
    #[tsify(optional, type = "Overrides[\"tracking.tracker\"]")]
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
    #[tsify(optional, type = "Overrides")]
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
        let Some(mut config) = Config::preset(&self.preset) else {
            let (found, names) = (&self.preset, Config::PRESETS.join(", "));
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
        if let Some(tracker) = &self.tracker {
            config.set("tracking.tracker", tracker.as_str())?;
        }
        for (path, value) in &self.overrides {
            config.set(path, value.clone())?;
        }
        config.validate()?;
        Ok(config)
    }
}

impl From<ConfigError> for SettingsError {
    fn from(e: ConfigError) -> SettingsError {
        SettingsError(format!("settings: {e}"))
    }
}

fn wrong<T>(name: &str, found: impl ToString, expected: &str) -> Result<T, SettingsError> {
    let found = found.to_string();
    Err(SettingsError(format!("settings: {name}: found {found}, expected {expected}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(path: &str, value: Value) -> Result<Config, SettingsError> {
        let overrides = [(path.to_owned(), value)].into();
        Settings { overrides, ..Settings::default() }.config()
    }

    #[test]
    fn the_page_offers_every_preset() {
        let page = include_str!("../../www/index.html");
        let list = page.split("id=\"preset\"").nth(1).and_then(|s| s.split("</select>").next());
        let offered: Vec<&str> = { list.unwrap() }
            .split("<option value=\"")
            .skip(1)
            .filter_map(|s| s.split('"').next())
            .collect();
        assert_eq!(offered, Config::PRESETS);
        for preset in Config::PRESETS {
            let config = Settings { preset: preset.into(), ..Settings::default() }.config();
            assert_eq!(config.unwrap(), Config::preset(preset).unwrap());
        }
    }

    #[test]
    fn single_values_are_set_and_mistakes_named() {
        assert_eq!(with("mapping.rays", 500u32.into()).unwrap().mapping.rays, 500);
        assert_eq!(with("loss.color", 2u32.into()).unwrap().loss.color, 2.0);
        for (path, value, part) in [
            ("mapping.rayz", 500u32.into(), "mapping.rayz"),
            ("mapping", 500u32.into(), "mapping"),
            ("mapping.rays", 1.5.into(), "1.5"),
            ("mapping.rays", 0u32.into(), "mapping.rays"),
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
