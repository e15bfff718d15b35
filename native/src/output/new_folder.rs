//! A new folder of files that are written one by one, such as a recording.
use anyhow::{Context, Result, bail};
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// A folder that appears whole or not at all: filled beside its place, then renamed.
pub struct NewFolder {
    dir: PathBuf,
    staging: PathBuf,
}

impl NewFolder {
    /// `dir` must be absent or empty, and writable.
    pub fn prepare(dir: &Path) -> Result<NewFolder> {
        let name = dir.display();
        if dir.exists() {
            let empty = fs::read_dir(dir).is_ok_and(|mut entries| entries.next().is_none());
            if !empty {
                bail!("{name}: found files there, expected an absent or empty folder");
            }
        }
        let Some(file_name) = dir.file_name() else {
            bail!("{name}: found no folder name at its end, expected for example data/room");
        };
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(file_name);
        hidden.push(".partial");
        let folder = NewFolder { dir: dir.to_owned(), staging: dir.with_file_name(hidden) };
        if folder.staging.exists() {
            fs::remove_dir_all(&folder.staging)
                .with_context(|| format!("{name}: an earlier attempt cannot be removed"))?;
        }
        fs::create_dir_all(&folder.staging)
            .with_context(|| format!("{name}: cannot be written; choose another folder"))?;
        Ok(folder)
    }

    /// Writes a file; `name` may hold folders.
    pub fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let path = self.staging.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(path, bytes)
    }

    /// Starts a file that is too large to be written at once.
    pub fn create(&self, name: &str) -> io::Result<fs::File> {
        fs::File::create(self.staging.join(name))
    }

    /// Puts everything in its place.
    pub fn publish(self) -> Result<()> {
        // An empty folder in its place gives way (renaming over one is not portable).
        let _ = fs::remove_dir(&self.dir);
        fs::rename(&self.staging, &self.dir)
            .with_context(|| format!("{}: cannot be written", self.dir.display()))
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        // Gone already when it was published.
        let _ = fs::remove_dir_all(&self.staging);
    }
}
