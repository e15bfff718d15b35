//! How this process was started.
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A command line, so that `--resume OUT` can repeat it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Invocation {
    /// Arguments after the program's name; empty where one is not Unicode.
    pub arguments: Vec<String>,
    /// Working directory, which relative paths start from.
    pub folder: PathBuf,
}

impl Invocation {
    /// Of this process; empty where an argument is not Unicode, and cannot be kept as JSON.
    pub fn here() -> Invocation {
        let arguments: Result<Vec<String>, _> =
            std::env::args_os().skip(1).map(std::ffi::OsString::into_string).collect();
        Invocation {
            arguments: arguments.unwrap_or_default(),
            folder: std::env::current_dir().unwrap_or_default(),
        }
    }

    /// The folder, when this is `run --resume DIR` and nothing else that matters.
    pub fn only_resumes(&self) -> Option<&str> {
        self.only("--resume")
    }

    /// The value of `flag`, when there is nothing else that matters after the command.
    pub fn only(&self, flag: &str) -> Option<&str> {
        let quiet = ["-q", "--quiet", "--json"];
        let rest: Vec<&str> =
            self.arguments.iter().map(String::as_str).filter(|a| !quiet.contains(a)).collect();
        match rest[..] {
            [_, name, value] if name == flag => Some(value),
            [_, both] => both.strip_prefix(flag)?.strip_prefix('='),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_short_form_is_told_from_the_whole_command() {
        let of = |text: &str| Invocation {
            arguments: text.split(' ').map(str::to_owned).collect(),
            folder: PathBuf::new(),
        };
        assert_eq!(of("run --resume out").only_resumes(), Some("out"));
        assert_eq!(of("-q run --resume=out --json").only_resumes(), Some("out"));
        assert_eq!(of("run --resume out --engine cpu").only_resumes(), None);
        assert_eq!(of("run room --resume").only_resumes(), None);
    }
}
