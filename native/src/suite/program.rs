//! This program as suites see it.
use super::options;
use crate::{configuration, errors::usage, synthetic};
use anyhow::Result;
use mte_slam_report::suite::program::{Program, RunOf};
use mte_slam_synth::SyntheticOptions;
use std::path::Path;
use toml::Table;

/// `mte-slam run`.
pub struct RunCommand;

impl Program for RunCommand {
    fn name(&self) -> String {
        format!("mte-slam {}", env!("CARGO_PKG_VERSION"))
    }

    fn check_options(&self, options: &Table, place: &str) -> Result<()> {
        options::arguments(options, place).map(|_| ())
    }

    fn run_of(&self, dataset: &Path, options: &Table, preset: &str, place: &str) -> Result<RunOf> {
        let args = options::run_args(dataset, options, place)?;
        let config = match configuration::resolve(&args.config, preset) {
            Ok(effective) => effective.config,
            Err(error) => usage!("{place}: {error:#}"),
        };
        let selection = &args.selection;
        let partial = selection.frames.is_some()
            || (selection.stride, selection.start) != (1, 0)
            || selection.scale != 1.0;
        Ok(RunOf {
            mesh: args.mesh.clone().unwrap_or_else(|| dataset.join("mesh.ply")),
            config_hash: configuration::hash(&config)?,
            partial,
        })
    }

    fn write_recording(&self, folder: &Path, options: SyntheticOptions) -> Result<()> {
        synthetic::write(folder, options, 0, |_| ())?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_report::suite::file::Suite;

    #[test]
    fn options_of_suites_are_those_of_the_command_line() {
        let text = "seeds = [1]\npresets = ['fast']\n[[scenes]]\nname = 'a'\n\
                    synthetic = { scene = 'room', frames = 4 }\noptions = { sacle = 0.5 }";
        let message = Suite::parse("s.toml", "s", text, &RunCommand).unwrap_err().to_string();
        assert!(message.contains("scenes.a.options"), "{message}");
        assert!(message.contains("Did you mean `scale`"), "{message}");
        for name in ["built-in", "replica", "scannet", "recordings", "tiny"] {
            Suite::read(Path::new(name), &RunCommand).unwrap();
        }
    }
}
