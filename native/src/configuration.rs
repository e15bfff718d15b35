//! The effective configuration: preset, then file, then `--set`, then the named flags.
//!
//! Keys are set on the serialised form by their dotted path, so a new key of the core's
//! configuration works here without being mentioned. What is wrong is said with what was found
//! and what was expected.
use crate::{
    args::{ConfigArgs, TrackerChoice},
    errors::{UsageError, usage},
};
use anyhow::{Context, Result};
use mte_slam_core::config::Config;
use serde::Deserialize;
use toml::{Table, Value};

/// The configuration of a run, and the preset it started from.
#[derive(Clone, Debug)]
pub struct Effective {
    /// Name of the preset.
    pub preset: String,
    /// All values.
    pub config: Config,
}

/// Work out the configuration. `default_preset` is taken when neither the flag nor the file's
/// `[run]` table names one.
pub fn effective(args: &ConfigArgs, default_preset: &str) -> Result<Effective> {
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
) -> Result<Effective> {
    let file = match file {
        Some((name, text)) => Some((name, parse_file(name, text)?)),
        None => None,
    };
    let recorded = file.as_ref().and_then(|(_, f)| f.preset.clone());
    let preset = args.preset.clone().or(recorded).unwrap_or_else(|| default_preset.to_owned());
    let Some(config) = Config::preset(&preset) else {
        let known = Config::PRESETS.join(", ");
        usage!("preset: found `{preset}`, expected one of {known}");
    };
    let mut table = Table::try_from(&config).context("the preset cannot be written as TOML")?;
    if let Some((name, file)) = file {
        overlay(&mut table, &file.values, "", name)?;
    }
    for text in &args.set {
        let Some((key, value)) = text.split_once('=') else {
            usage!("--set {text}: found no `=`, expected KEY=VALUE, for example seed=7");
        };
        set(&mut table, key.trim(), parse_value(value.trim()), "--set")?;
    }
    if let Some(tracker) = args.tracker {
        let name = match tracker {
            TrackerChoice::Align => "align",
            TrackerChoice::Render => "render",
            TrackerChoice::Truth => "truth",
        };
        set(&mut table, "tracking.tracker", Value::String(name.to_owned()), "--tracker")?;
    }
    if let Some(seed) = args.seed {
        set(&mut table, "seed", Value::Integer(seed.into()), "--seed")?;
    }
    let config = from_table(&table).map_err(|e| UsageError(format!("configuration: {e}")))?;
    config.validate().map_err(|e| UsageError(e.to_string()))?;
    Ok(Effective { preset, config })
}

struct FileValues {
    values: Table,
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
    Ok(FileValues { values, preset })
}

fn overlay(table: &mut Table, values: &Table, prefix: &str, source: &str) -> Result<()> {
    for (key, value) in values {
        let path = format!("{prefix}{key}");
        match value {
            Value::Table(inner) if matches!(lookup(table, &path), Some(Value::Table(_))) => {
                overlay(table, inner, &format!("{path}."), source)?;
            }
            _ => set(table, &path, value.clone(), source)?,
        }
    }
    Ok(())
}

fn lookup<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let mut parts = path.split('.');
    let mut value = table.get(parts.next()?)?;
    for part in parts {
        value = value.get(part)?;
    }
    Some(value)
}

fn insert(table: &mut Table, path: &str, value: Value) -> bool {
    match path.split_once('.') {
        None => {
            table.insert(path.to_owned(), value);
            true
        }
        Some((head, rest)) => match table.get_mut(head) {
            Some(Value::Table(inner)) => insert(inner, rest, value),
            _ => false,
        },
    }
}

/// Set one key; `source` (a flag or a file) starts the message when that cannot be.
fn set(table: &mut Table, path: &str, value: Value, source: &str) -> Result<()> {
    let value = match (lookup(table, path), value) {
        (None, value) => {
            // A key without a value (an option left open) is not in the serialised form.
            let mut attempt = table.clone();
            let kind = value.type_str();
            if insert(&mut attempt, path, value) {
                match from_table(&attempt) {
                    Ok(_) => {
                        *table = attempt;
                        return Ok(());
                    }
                    Err(e) if !e.to_string().contains("unknown field") => {
                        usage!("{source}: {path}: found {kind}: {}", one_line(&e))
                    }
                    Err(_) => {}
                }
            }
            usage!("{source}: no key `{path}`. {}", suggestion(table, path));
        }
        (Some(Value::Table(section)), value) => usage!(
            "{source}: {path}: found {}, expected one of its keys: {}",
            value.type_str(),
            section.keys().map(|k| format!("{path}.{k}")).collect::<Vec<_>>().join(", ")
        ),
        (Some(Value::Float(_)), Value::Integer(i)) => Value::Float(i as f64),
        // `--set name=5` where a text is wanted.
        (Some(Value::String(_)), value @ (Value::Integer(_) | Value::Float(_))) => {
            Value::String(value.to_string())
        }
        (Some(old), value) if old.same_type(&value) => value,
        (Some(old), value) => usage!(
            "{source}: {path}: found {} {value}, expected {} (such as {old})",
            value.type_str(),
            old.type_str()
        ),
    };
    let mut attempt = table.clone();
    insert(&mut attempt, path, value.clone());
    if let Err(e) = from_table(&attempt) {
        usage!("{source}: {path}: found {value}: {}", one_line(&e));
    }
    *table = attempt;
    Ok(())
}

fn from_table(table: &Table) -> Result<Config, toml::de::Error> {
    Config::deserialize(Value::Table(table.clone()))
}

fn one_line(error: &toml::de::Error) -> String {
    error.message().replace('\n', " ")
}

/// A value as TOML writes it, or else a text: `--set tracking.tracker=render` needs no quotes.
fn parse_value(text: &str) -> Value {
    format!("value = {text}")
        .parse::<Table>()
        .ok()
        .filter(|t| t.len() == 1)
        .and_then(|mut t| t.remove("value"))
        .unwrap_or_else(|| Value::String(text.to_owned()))
}

fn suggestion(table: &Table, path: &str) -> String {
    let mut keys = Vec::new();
    flatten(table, "", &mut keys);
    let last = path.rsplit('.').next().unwrap_or(path);
    let mut near: Vec<(usize, &String)> = keys
        .iter()
        .filter_map(|key| {
            let key_last = key.rsplit('.').next().unwrap_or(key);
            // The right name in the wrong section, or a slip of the fingers.
            let distance = edit_distance(key, path).min(1 + edit_distance(key_last, last));
            (distance <= 1 + last.len() / 3).then_some((distance, key))
        })
        .collect();
    near.sort();
    near.truncate(4);
    if near.is_empty() {
        format!("There are: {}", keys.join(", "))
    } else {
        let names: Vec<_> = near.iter().map(|(_, key)| format!("`{key}`")).collect();
        format!("Did you mean {}?", names.join(" or "))
    }
}

fn flatten(table: &Table, prefix: &str, keys: &mut Vec<String>) {
    for (key, value) in table {
        match value {
            Value::Table(inner) => flatten(inner, &format!("{prefix}{key}."), keys),
            _ => keys.push(format!("{prefix}{key}")),
        }
    }
}

/// How many letters must be changed, added or left out to make one text of the other.
pub fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
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

    fn with(set: &[&str]) -> Result<Effective> {
        let set = set.iter().map(|s| (*s).to_owned()).collect();
        effective(&ConfigArgs { set, ..ConfigArgs::default() }, "replica")
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
    }

    #[test]
    fn a_written_configuration_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.toml");
        let config = with(&["seed=11"]).unwrap().config;
        let text = to_toml(&config).unwrap() + "\n[run]\npreset = \"tum\"\nversion = \"x\"\n";
        std::fs::write(&path, text).unwrap();
        let args = ConfigArgs { config: Some(path.clone()), ..ConfigArgs::default() };
        let back = effective(&args, "replica").unwrap();
        assert_eq!(back.preset, "tum");
        assert_eq!(hash(&back.config).unwrap(), hash(&config).unwrap());
        std::fs::write(&path, "[tracking]\nspeed = 3\n").unwrap();
        let error = effective(&args, "replica").unwrap_err().to_string();
        assert!(error.contains("config.toml") && error.contains("tracking.speed"), "{error}");
    }
}
