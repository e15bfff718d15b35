//! The settings as documents: the guide in Markdown, and the types of the browser's package.
use super::{Config, presets::purpose};
use crate::settings::{self, Documentation, Entry, Kind, Range, Value};
use alloc::{
    format,
    string::{String, ToString},
    vec::Vec,
};
use core::fmt::Write;

const INTRODUCTION: &str = "# Configuration\n\n\
    <!-- Written by `mte-slam settings --markdown`; a test compares. -->\n\n\
    Every setting of a run, with its default. A run starts from a preset (`--preset NAME`), takes \
    what a file says (`--config FILE`, TOML), then single settings (`--set KEY=VALUE`, \
    repeatedly), then the flags `--tracker` and `--seed`; later ones win. On the page, \
    `set.KEY=VALUE` in the address does the same as `--set`.\n\n\
    A run writes its complete configuration to `config.toml` in its output folder; `--config` \
    takes it back. Unknown keys, wrong types and values out of range are errors that name the key. \
    `mte-slam settings` prints this list, and `mte-slam settings WORD` those that match.\n";

/// The guide to the configuration, in Markdown.
pub fn markdown() -> String {
    let texts = settings::documentation::<Config>();
    let defaults = Config::default().settings();
    let mut out = String::from(INTRODUCTION);
    out += "\n## Presets\n\n| Preset | For | Differs from the defaults in |\n| --- | --- | --- |\n";
    for name in Config::PRESETS {
        let changed = changes(name, &defaults);
        let changed = if changed.is_empty() { "nothing".into() } else { changed.join(", ") };
        let _ = writeln!(out, "| `{name}` | {} | {changed} |", purpose(name));
    }
    let mut section = None;
    for entry in &defaults {
        let above = entry.path.rsplit_once('.').map_or("", |(above, _)| above);
        if section != Some(above) {
            section = Some(above);
            heading(&mut out, above, &texts);
        }
        row(&mut out, entry, &texts);
    }
    out
}

fn changes(preset: &str, defaults: &[Entry]) -> Vec<String> {
    let entries = Config::preset(preset).map(|c| c.settings()).unwrap_or_default();
    entries
        .iter()
        .zip(defaults)
        .filter(|(a, b)| a.value != b.value)
        .map(|(a, _)| format!("`{}={}`", a.path, a.value))
        .collect()
}

fn heading(out: &mut String, section: &str, texts: &Documentation) {
    let title = if section.is_empty() { "General".into() } else { format!("`{section}`") };
    let _ = write!(out, "\n## {title}\n\n");
    // What a section is for in its place says more than what its type is for.
    if let (false, Some(text)) = (section.is_empty(), texts.of_setting(section)) {
        let _ = write!(out, "{text}\n\n");
    }
    *out += "| Key | Default | Unit | Values | Meaning |\n| --- | --- | --- | --- | --- |\n";
}

fn row(out: &mut String, entry: &Entry, texts: &Documentation) {
    let Entry { path, kind, unit, range, value } = entry;
    let mut text = texts.of_setting(path).unwrap_or_default().to_string();
    for (name, meaning) in texts.of_choices(path) {
        let _ = write!(text, " `{name}`: {meaning}");
    }
    let text = text.replace('|', "\\|");
    let _ = writeln!(out, "| `{path}` | `{value}` | {unit} | {} | {text} |", values(kind, range));
}

/// The values that a setting may have, in a few words.
pub fn values(kind: &Kind, range: &Range) -> String {
    match (kind, range) {
        (Kind::Boolean, _) => "`true`, `false`".into(),
        (Kind::Choice(names), _) => {
            let names: Vec<String> = names.iter().map(|n| format!("`{n}`")).collect();
            names.join(", ")
        }
        (Kind::Integer, Range::Any) => "whole, 0 to 4294967295".into(),
        (Kind::Number, Range::Any) => "a number".into(),
        (Kind::Integer, range) => format!("whole, {range}"),
        (Kind::Number, range) => range.to_string(),
        (Kind::Integers(n), range) => format!("{n} whole numbers, {range}"),
    }
}

/// TypeScript's types of the presets and of single settings, for the browser's package.
pub fn typescript() -> String {
    let texts = settings::documentation::<Config>();
    let mut out = String::from(
        "// Written by `mte-slam settings --typescript`; a test compares.\n\n\
         /** Name of a preset. */\nexport type Preset = ",
    );
    let names: Vec<String> = Config::PRESETS.iter().map(|n| format!("\"{n}\"")).collect();
    let _ = write!(
        out,
        "{};\n\n/** Single values of the configuration by dotted path. */\nexport interface \
         Overrides {{\n",
        names.join(" | ")
    );
    for entry in Config::default().settings() {
        let Entry { path, kind, unit, range, value } = entry;
        let of = match kind {
            Kind::Boolean => "boolean".into(),
            Kind::Integer | Kind::Number => "number".into(),
            Kind::Integers(_) => "number[]".into(),
            Kind::Choice(names) => {
                let names: Vec<String> = names.iter().map(|n| format!("\"{n}\"")).collect();
                names.join(" | ")
            }
        };
        let mut about = texts.of_setting(&path).unwrap_or_default().to_string();
        if !unit.is_empty() {
            let _ = write!(about, " [{unit}]");
        }
        let _ = write!(about, " Default {value}");
        if let (Kind::Integer | Kind::Number | Kind::Integers(_), false) =
            (kind, range == Range::Any)
        {
            let _ = write!(about, "; {range}");
        }
        let _ = writeln!(out, "  /** {about}. */\n  \"{path}\"?: {of};");
    }
    out += "}\n";
    out
}

/// Lines of plain text: the settings whose path or meaning holds `word`, all for an empty word.
pub fn plain(config: &Config, word: &str) -> Vec<(String, Value, String)> {
    let texts = settings::documentation::<Config>();
    let word = word.to_lowercase();
    let mut lines = Vec::new();
    for Entry { path, kind, unit, range, value } in config.settings() {
        let text = texts.of_setting(&path).unwrap_or_default();
        if !path.contains(&word) && !text.to_lowercase().contains(&word) {
            continue;
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
        let about = format!("{text}{unit} ({})", values(&kind, &range).replace('`', ""));
        lines.push((path, value, about));
    }
    lines
}
