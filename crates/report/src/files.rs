//! Files of figures: written so that nobody reads half of one, and read back.
use anyhow::{Context, Result};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Folder, in a run's output folder, of what an interrupted run resumes from. It is removed after
/// the results are in place, so a folder that has it holds no finished run.
pub const RESUME_FOLDER: &str = ".resume";

/// Writes one file: to a temporary name first, then renamed. Missing folders are made.
///
/// # Errors
/// The file cannot be written.
pub fn replace_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(".tmp");
    let temporary = PathBuf::from(temporary);
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).with_context(|| not_written(path))?;
    }
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    written.with_context(|| not_written(path))
}

/// The message about a file that cannot be written.
pub fn not_written(path: &Path) -> String {
    format!("{}: cannot be written (disk full, or no right to?)", path.display())
}

/// Reads a file of figures.
///
/// # Errors
/// The file cannot be read or holds no JSON.
pub fn read_json(path: &Path) -> Result<Value> {
    let name = path.display();
    let text = fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    serde_json::from_str(&text).with_context(|| format!("{name}: found no JSON"))
}
