//! Stand-in for the configuration.
#![allow(missing_docs)]
use alloc::string::String;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tracker {
    Align,
    Render,
    Truth,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackingConfig {
    pub tracker: Tracker,
    pub iterations: u32,
    pub learning_rate: f64,
}

impl Default for TrackingConfig {
    fn default() -> Self {
        TrackingConfig { tracker: Tracker::Align, iterations: 8, learning_rate: 1e-3 }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MappingConfig {
    pub iterations: u32,
    pub rays: u32,
    pub max_keyframes: Option<u32>,
}

impl Default for MappingConfig {
    fn default() -> Self {
        MappingConfig { iterations: 15, rays: 4000, max_keyframes: None }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    pub seed: u64,
    pub tracking: TrackingConfig,
    pub mapping: MappingConfig,
}

#[derive(Clone, Debug, thiserror::Error)]
#[error("{field}: found {found}, expected {expected}")]
pub struct ConfigError {
    pub field: String,
    pub found: String,
    pub expected: String,
}

impl Config {
    pub const PRESETS: [&'static str; 4] = ["fast", "replica", "scannet", "tum"];

    pub fn preset(name: &str) -> Option<Config> {
        Self::PRESETS.contains(&name).then(Config::default)
    }

    pub fn validate(&self) -> Result<(), ConfigError> {
        if self.mapping.rays == 0 {
            return Err(ConfigError {
                field: "mapping.rays".into(),
                found: "0".into(),
                expected: "at least 1".into(),
            });
        }
        Ok(())
    }
}
