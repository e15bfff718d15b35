//! The file of one run: a recording and options, so that `mte-slam run --from FILE` is all that
//! any scheduler has to know. It is idempotent: it starts the run, continues it after an
//! interruption, or finds it finished and does nothing.
use super::options;
use crate::usage;
use anyhow::Result;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Its name in the folder of the run.
pub const NAME: &str = "run.toml";

/// The recording's key.
const DATASET: &str = "dataset";

/// The file's text: keys in alphabetical order, so that equal inputs are equal bytes.
pub fn text(dataset: &str, options: &Table) -> Result<String> {
    let mut all = options.clone();
    all.insert(DATASET.to_owned(), Value::String(dataset.to_owned()));
    Ok(format!(
        "# The inputs of one run. `mte-slam run --from` this file starts it, continues it, or\n\
         # leaves it alone once it has finished. Relative paths start from this file's folder.\n{}",
        toml::to_string(&all)?
    ))
}

/// What such a file says.
pub struct RunFile {
    /// The recording.
    pub dataset: PathBuf,
    /// Options of `run`, paths resolved.
    pub options: Table,
}

/// Reads one.
pub fn read(path: &Path) -> Result<RunFile> {
    let name = path.display();
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) => usage!("{name}: the file of the run cannot be read: {e}"),
    };
    let mut options: Table = match text.parse() {
        Ok(table) => table,
        Err(e) => usage!("{name}: not TOML: {}", e.to_string().trim_end()),
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let dataset = match options.remove(DATASET) {
        Some(Value::String(path)) => folder.join(path),
        Some(other) => {
            usage!("{name}: dataset: found {}, expected a path in quotes", other.type_str())
        }
        None => usage!("{name}: dataset: found none, expected the path of a recording"),
    };
    options::resolve_paths(&mut options, folder);
    Ok(RunFile { dataset, options })
}
