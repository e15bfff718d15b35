//! `run --from FILE`: the file of one run as the flags that it stands for.
use super::options;
use crate::args::RunArgs;
use anyhow::Result;
use mte_slam_report::suite::run_file::{RunFile, read};
use std::path::Path;

/// The flags of `run` that a file stands for: into its own folder, continued where it ended.
pub fn run_args(path: &Path) -> Result<RunArgs> {
    let RunFile { dataset, options } = read(path)?;
    let mut args = options::run_args(&dataset, &options, &path.display().to_string())?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    args.output.out = Some(folder.to_owned());
    // The file itself, and a log, lie there already.
    args.output.force = true;
    args.output.resume = Some(None);
    Ok(args)
}
