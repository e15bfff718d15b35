//! What a suite asks of the program whose runs it plans.
use anyhow::Result;
use mte_slam_synth::SyntheticOptions;
use std::path::{Path, PathBuf};
use toml::Table;

/// The program that makes the runs. Its options are keys of TOML tables, its flags without the
/// leading dashes and with `_` for `-`; only it knows which there are.
pub trait Program {
    /// Name and version, as its runs record them.
    fn name(&self) -> String;

    /// Refuses keys that are no options of a run. `place` (a file and, in it, a table) starts the
    /// message. Values are checked where they are used.
    ///
    /// # Errors
    /// [`crate::UsageError`] naming the key.
    fn check_options(&self, options: &Table, place: &str) -> Result<()>;

    /// What a run of a recording with these options is.
    ///
    /// # Errors
    /// [`crate::UsageError`] naming what is wrong with an option or the configuration.
    fn run_of(&self, dataset: &Path, options: &Table, preset: &str, place: &str) -> Result<RunOf>;

    /// Writes a built-in recording to a folder.
    ///
    /// # Errors
    /// The folder cannot be written.
    fn write_recording(&self, folder: &Path, options: SyntheticOptions) -> Result<()>;
}

/// What a program says about one run.
#[derive(Clone, Debug)]
pub struct RunOf {
    /// The true mesh, where there may be one.
    pub mesh: PathBuf,
    /// Hash of the run's configuration.
    pub config_hash: String,
    /// Whether the options ask for less than the whole recording.
    pub partial: bool,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::usage;

    /// Knows the options of the included suites and nothing else of a program.
    pub(crate) struct Pretend;

    impl Program for Pretend {
        fn name(&self) -> String {
            "pretend 1.0".to_owned()
        }

        fn check_options(&self, options: &Table, place: &str) -> Result<()> {
            const KNOWN: [&str; 11] = [
                "classes",
                "engine",
                "frames",
                "labels",
                "mesh",
                "mesh_resolution",
                "mesh_views",
                "render_every",
                "scale",
                "set",
                "stride",
            ];
            match options.keys().find(|key| !KNOWN.contains(&key.as_str())) {
                Some(key) => usage!("{place}: found the key `{key}`, expected an option"),
                None => Ok(()),
            }
        }

        fn run_of(&self, dataset: &Path, _: &Table, preset: &str, _: &str) -> Result<RunOf> {
            let mesh = dataset.join("mesh.ply");
            Ok(RunOf { mesh, config_hash: preset.to_owned(), partial: false })
        }

        fn write_recording(&self, folder: &Path, _: SyntheticOptions) -> Result<()> {
            Ok(std::fs::create_dir_all(folder)?)
        }
    }
}
