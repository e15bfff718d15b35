//! `mte-slam settings`.
use crate::{args::SettingsArgs, errors::usage, screen::Screen};
use anyhow::Result;
use mte_slam_core::config::{Config, guide};
use std::fmt::Write;

/// Prints every setting, or those that match.
pub fn run(args: &SettingsArgs, screen: Screen) -> Result<()> {
    let Some(config) = Config::preset(&args.preset) else {
        usage!("--preset: found `{}`, expected one of {}", args.preset, Config::PRESETS.join(", "));
    };
    let lines = guide::plain(&config, &args.word);
    if lines.is_empty() && !args.word.is_empty() {
        usage!("no setting contains `{}`", args.word);
    }
    let mut text = String::new();
    if args.markdown {
        text = guide::markdown();
    } else if args.typescript {
        text = guide::typescript();
    } else {
        for (path, value, about) in &lines {
            writeln!(text, "{path} = {value}\n    {about}")?;
        }
    }
    screen.result(&text, &format!("{:#}\n", serde_json::to_value(&config)?));
    Ok(())
}
