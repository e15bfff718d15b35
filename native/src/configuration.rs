//! The configuration of a run: preset, then file, then `--set`, then the named flags.
//!
//! The core knows which settings there are and what they may be; here their values are read, and
//! the source of a wrong one (a flag or a file) is named.
use crate::{
    args::{ConfigArgs, TrackerChoice},
    errors::{UsageError, usage},
};
use anyhow::{Context, Result};
use mte_slam_core::{
    config::{Config, ConfigError},
    settings::{self, Value},
};
use serde::Deserialize;
use toml::Table;

/// The configuration of a run, and the preset it started from.
#[derive(Clone, Debug)]
pub struct Configured {
    /// Name of the preset.
    pub preset: String,
    /// All values.
    pub config: Config,
}

/// Works out the configuration. `default_preset` is taken when neither the flag nor the file's
/// `[run]` table names one.
pub fn resolve(args: &ConfigArgs, default_preset: &str) -> Result<Configured> {
    let Some(path) = &args.config else { return with_file(args, default_preset, None) };
    let name = path.display().to_string();
    match std::fs::read_to_string(path) {
        Ok(text) => with_file(args, default_preset, Some((&name, &text))),
        Err(e) => usage!("{name}: the configuration file cannot be read: {e}"),
    }
}

/// The same with the file's name, for messages, and its text.
pub fn with_file(
    args: &ConfigArgs,
    default_preset: &str,
    file: Option<(&str, &str)>,
) -> Result<Configured> {
    let file = match file {
        Some((name, text)) => Some((name, parse_file(name, text)?)),
        None => None,
    };
    let recorded = file.as_ref().and_then(|(_, f)| f.preset.clone());
    let preset = args.preset.clone().or(recorded).unwrap_or_else(|| default_preset.to_owned());
    let Some(mut config) = Config::preset(&preset) else {
        let known = Config::PRESETS.join(", ");
        usage!("preset: found `{preset}`, expected one of {known}");
    };
    if let Some((name, file)) = file {
        settings::merge(&mut config, file.values, true).map_err(|e| refused(name, &e))?;
    }
    let mut set = |source: &str, key: &str, value: Value| {
        config.set(key, value).map_err(|e| refused(source, &e))
    };
    for text in &args.set {
        let Some((key, value)) = text.split_once('=') else {
            usage!("--set {text}: found no `=`, expected KEY=VALUE, for example seed=7");
        };
        set("--set", key.trim(), parse_value(value.trim()))?;
    }
    if let Some(tracker) = args.tracker {
        let name = match tracker {
            TrackerChoice::Align => "align",
            TrackerChoice::Render => "render",
            TrackerChoice::Truth => "truth",
        };
        set("--tracker", "tracking.tracker", name.into())?;
    }
    if let Some(seed) = args.seed {
        set("--seed", "seed", seed.into())?;
    }
    config.validate().map_err(|e| refused("configuration", &e))?;
    Ok(Configured { preset, config })
}

/// `source` (a flag or a file) starts the message.
fn refused(source: &str, error: &ConfigError) -> UsageError {
    match error {
        ConfigError::Unknown { similar, .. } if similar.is_empty() => {
            let paths: Vec<String> =
                Config::default().settings().into_iter().map(|entry| entry.path).collect();
            UsageError(format!("{source}: {error}. There are: {}", paths.join(", ")))
        }
        _ => UsageError(format!("{source}: {error}")),
    }
}

struct FileValues {
    values: Value,
    preset: Option<String>,
}

fn parse_file(name: &str, text: &str) -> Result<FileValues> {
    let mut values: Table = match text.parse() {
        Ok(table) => table,
        Err(e) => usage!("{name}: not TOML: {}", e.to_string().trim_end()),
    };
    // What a run records beside its configuration: kept for people, not configuration.
    let run = values.remove("run");
    let preset = run.and_then(|r| Some(r.get("preset")?.as_str()?.to_owned()));
    let values = Value::deserialize(values)
        .map_err(|e| UsageError(format!("{name}: {}", e.message().replace('\n', " "))))?;
    Ok(FileValues { values, preset })
}

/// A value as TOML writes it, or else a text: `--set tracking.tracker=render` needs no quotes.
fn parse_value(text: &str) -> Value {
    format!("value = {text}")
        .parse::<Table>()
        .ok()
        .filter(|t| t.len() == 1)
        .and_then(|mut t| Value::deserialize(t.remove("value")?).ok())
        .unwrap_or_else(|| Value::Text(text.to_owned()))
}

/// The configuration as TOML, keys in a fixed order.
pub fn to_toml(config: &Config) -> Result<String> {
    toml::to_string(config).context("the configuration cannot be written as TOML")
}

/// A short name of all values (FNV-1a of their TOML), to see whether two runs had the same.
pub fn hash(config: &Config) -> Result<String> {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for byte in to_toml(config)?.bytes() {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
    Ok(format!("{hash:016x}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(set: &[&str]) -> Result<Configured> {
        let set = set.iter().map(|s| (*s).to_owned()).collect();
        resolve(&ConfigArgs { set, ..ConfigArgs::default() }, "replica")
    }

    fn message(set: &str) -> String {
        let error = with(&[set]).unwrap_err();
        assert!(error.downcast_ref::<UsageError>().is_some(), "exit code 2");
        error.to_string()
    }

    #[test]
    fn values_are_set_by_path() {
        let e = with(&["seed=7", "tracking.tracker=render"]).unwrap();
        assert_eq!(e.config.seed, 7);
        assert_eq!(e.config.tracking.tracker, mte_slam_core::config::Tracker::Render);
        let e = with(&["odometry.align.iterations=[1, 2, 3, 4]", "loss.color=2"]).unwrap();
        assert_eq!(e.config.odometry.align.iterations, [1, 2, 3, 4]);
        assert_eq!(e.config.loss.color, 2.0);
    }

    #[test]
    fn every_preset_can_be_chosen() {
        for name in Config::PRESETS {
            let preset = Some(name.to_owned());
            let e = resolve(&ConfigArgs { preset, ..ConfigArgs::default() }, "replica").unwrap();
            assert_eq!(e.config, Config::preset(name).unwrap());
            let text = to_toml(&e.config).unwrap();
            let file = Some(("config.toml", text.as_str()));
            let read = with_file(&ConfigArgs::default(), "replica", file).unwrap();
            assert_eq!(read.config, e.config);
        }
    }

    /// A file of a version that knew fewer settings.
    #[test]
    fn a_file_without_the_odometry_is_read() {
        let mut table = Table::try_from(Config::preset("tum").unwrap()).unwrap();
        table.remove("odometry").unwrap();
        let text = table.to_string() + "\n[run]\npreset = \"tum\"\n";
        let file = Some(("config.toml", text.as_str()));
        let read = with_file(&ConfigArgs::default(), "replica", file).unwrap();
        assert_eq!(read.config, Config::preset("tum").unwrap());
    }

    #[test]
    fn wrong_keys_and_values_say_what_is_right() {
        assert!(message("tracking.traker=align").contains("`tracking.tracker`"));
        assert!(message("tracker=align").contains("`tracking.tracker`"));
        let m = message("seed=abc");
        assert!(m.contains("found string") && m.contains("expected integer"), "{m}");
        assert!(message("seed").contains("KEY=VALUE"));
        assert!(message("tracking=3").contains("tracking.tracker"));
        assert!(message("tracking.tracker=laser").contains("align"));
        assert!(message("seed=-1").contains("seed"));
        assert!(message("qqqqqqq=1").contains("There are"));
        assert!(message("tracking.render_loss.depth=-1").contains("tracking.render_loss.depth"));
        assert!(message("odometry.align.iterations=[1,2]").contains("4 integers"));
        assert!(message("mapping.rays=4").contains("mapping.window"));
    }

    #[test]
    fn a_written_configuration_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.toml");
        let config = with(&["seed=11"]).unwrap().config;
        let text = to_toml(&config).unwrap() + "\n[run]\npreset = \"tum\"\nversion = \"x\"\n";
        std::fs::write(&path, text).unwrap();
        let args = ConfigArgs { config: Some(path.clone()), ..ConfigArgs::default() };
        let back = resolve(&args, "replica").unwrap();
        assert_eq!(back.preset, "tum");
        assert_eq!(hash(&back.config).unwrap(), hash(&config).unwrap());
        std::fs::write(&path, "[tracking]\nspeed = 3\n").unwrap();
        let error = resolve(&args, "replica").unwrap_err().to_string();
        assert!(error.contains("config.toml") && error.contains("tracking.speed"), "{error}");
    }
}
