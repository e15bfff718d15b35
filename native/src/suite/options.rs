//! Flags of `run` as keys of a TOML table, in a suite and in the file of one run.
//!
//! What there is, is asked of the command line itself, so a new flag of `run` is a new key here.
use crate::{
    args::{Cli, Command, RunArgs},
    errors::{UsageError, usage},
};
use anyhow::{Result, anyhow};
use clap::{ArgAction, CommandFactory, Parser};
use mte_slam_core::settings::edit_distance;
use std::path::Path;
use toml::{Table, Value};

/// What a file of one run decides by itself, and not by these keys.
const DECIDED: [&str; 6] = ["out", "force", "resume", "from", "config", "help"];

/// The options as arguments of `run`; `place` (a file and, in it, a table) starts the messages.
pub fn arguments(options: &Table, place: &str) -> Result<Vec<String>> {
    let cli = Cli::command();
    let Some(run) = cli.find_subcommand("run") else {
        return Err(anyhow!("the command line has lost `run`"));
    };
    let known = || {
        let names = run.get_arguments().filter_map(|a| Some((a, a.get_long()?.replace('-', "_"))));
        names.filter(|(_, name)| !DECIDED.contains(&name.as_str()))
    };
    let mut arguments = Vec::new();
    for (key, value) in options {
        let Some((flag, _)) = known().find(|(_, name)| name == key) else {
            let names: Vec<String> = known().map(|(_, name)| name).collect();
            let near = names.iter().min_by_key(|name| edit_distance(name, key));
            let near = near.filter(|name| edit_distance(name, key) <= 1 + key.len() / 3);
            let hint = near.map_or(String::new(), |n| format!("Did you mean `{n}`? "));
            usage!(
                "{place}: found the key `{key}`, expected an option of `mte-slam run`. {hint}There \
                 are: {}",
                names.join(", ")
            );
        };
        let long = key.replace('_', "-");
        let takes_value = flag.get_action().takes_values();
        let wrong = |expected: &str| {
            let kind = value.type_str();
            Err(UsageError(format!("{place}: {key}: found {kind} {value}, expected {expected}")))
        };
        match value {
            Value::Boolean(given) if !takes_value => {
                if *given {
                    arguments.push(format!("--{long}"));
                }
            }
            Value::Array(values) if matches!(flag.get_action(), ArgAction::Append) => {
                for value in values {
                    let Some(text) = scalar(value) else {
                        return Ok(wrong("a list of texts or numbers")?);
                    };
                    arguments.push(format!("--{long}={text}"));
                }
            }
            // A camera may be a list of numbers.
            Value::Array(values) if takes_value => {
                let words: Option<Vec<String>> = values.iter().map(scalar).collect();
                let Some(words) = words else { return Ok(wrong("a text or numbers")?) };
                arguments.push(format!("--{long}={}", words.join(" ")));
            }
            _ if !takes_value => return Ok(wrong("true or false")?),
            _ => match scalar(value) {
                Some(text) => arguments.push(format!("--{long}={text}")),
                None => return Ok(wrong("a text or a number")?),
            },
        }
    }
    Ok(arguments)
}

fn scalar(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Integer(_) | Value::Float(_) => Some(value.to_string()),
        _ => None,
    }
}

/// The flags of `run` for a recording and options; what is wrong with them is said as on the
/// command line, after `place`.
pub fn run_args(dataset: &Path, options: &Table, place: &str) -> Result<RunArgs> {
    let mut all = vec!["mte-slam".to_owned(), "run".to_owned()];
    all.extend(arguments(options, place)?);
    all.push("--".to_owned());
    all.push(dataset.display().to_string());
    match Cli::try_parse_from(all) {
        Ok(Cli { command: Command::Run(args), .. }) => Ok(args),
        Ok(_) => Err(anyhow!("{place}: found no arguments of `run`")),
        Err(error) => {
            // The first paragraph says what is wrong; usage and tips are of the command line.
            let text = error.to_string();
            let text = text.split("\n\n").next().unwrap_or_default().replace('\n', " ");
            usage!("{place}: {}", text.trim_start_matches("error: ").trim())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        text.parse().unwrap()
    }

    fn message(text: &str) -> String {
        run_args(Path::new("room"), &table(text), "s.toml: options").unwrap_err().to_string()
    }

    #[test]
    fn options_become_flags() {
        let options = table(
            "frames = 7\nscale = 0.5\nno_mesh = true\nlabels = 'none'\nset = ['seed=3', 'a=b']\n\
             camera = [525, 525, 319.5, 239.5]\nengine = 'cpu'",
        );
        let args = run_args(Path::new("-odd room"), &options, "x").unwrap();
        assert_eq!(args.dataset.as_deref(), Some(Path::new("-odd room")));
        assert_eq!((args.selection.frames, args.selection.scale), (Some(7), 0.5));
        assert!(args.output.no_mesh && args.config.set == ["seed=3", "a=b"]);
        assert_eq!(args.selection.sensor.camera.unwrap().focal_centre[3], 239.5);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let m = message("framse = 3");
        assert!(m.contains("s.toml: options") && m.contains("`framse`"), "{m}");
        assert!(m.contains("Did you mean `frames`?") && m.contains("render_every"), "{m}");
        assert!(message("out = 'x'").contains("`out`"), "decided elsewhere");
        let m = message("scale = 3.0");
        assert!(m.contains("--scale") && m.contains("'3.0'") && m.contains("at most 1"), "{m}");
        let m = message("no_mesh = 1");
        assert!(m.contains("found integer 1, expected true or false"), "{m}");
        assert!(message("engine = 'tpu'").contains("auto, gpu, cpu"));
        assert!(message("frames = [[1]]").contains("expected"));
    }
}
