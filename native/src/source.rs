//! A folder on disk as a source of named bytes.
use mte_slam_core::sequence::{SequenceError, Source};
use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

/// More files than any recording has; a folder with more was not meant.
const MAX_FILES: usize = 2_000_000;
/// Larger than any file of a recording that is read as a whole \[bytes\].
const MAX_FILE_BYTES: u64 = 1 << 30;
/// The one file that is also looked for beside the folder: Replica's scenes share it.
const SHARED: &str = "cam_params.json";

/// The files below a folder, listed once at opening. Links are followed only to files inside
/// the folder; beside the folder itself only `../cam_params.json` can be read.
pub struct FolderSource {
    name: String,
    root: PathBuf,
    files: BTreeSet<String>,
    skipped_links: Vec<String>,
}

impl FolderSource {
    /// Lists a folder.
    ///
    /// # Errors
    /// [`SequenceError::Read`] when there is no such folder, it is a file, or it or a folder
    /// below it cannot be listed.
    pub fn open(path: &Path) -> Result<Self, SequenceError> {
        let failed =
            |reason: String| SequenceError::Read { file: path.display().to_string(), reason };
        let root = path.canonicalize().map_err(|e| failed(explain(&e, "folder")))?;
        let kind = fs::metadata(&root).map_err(|e| failed(explain(&e, "folder")))?;
        if !kind.is_dir() {
            return Err(failed("a file, where a folder with a recording is expected".into()));
        }
        // "." says little in messages, and the name of a TUM folder tells its camera.
        let shown = if path.file_name().is_some() { path } else { &root };
        let name = shown.display().to_string();
        let mut source = Self { name, root, files: BTreeSet::new(), skipped_links: Vec::new() };
        source.walk()?;
        if let Some(above) = source.root.parent()
            && fs::symlink_metadata(above.join(SHARED)).is_ok_and(|m| m.is_file())
        {
            source.files.insert(format!("../{SHARED}"));
        }
        Ok(source)
    }

    /// Links that were not followed, because they lead out of the folder, nowhere, or to a
    /// folder; sorted.
    pub fn skipped_links(&self) -> &[String] {
        &self.skipped_links
    }

    fn walk(&mut self) -> Result<(), SequenceError> {
        let mut folders = vec![String::new()];
        while let Some(folder) = folders.pop() {
            let failed = |e: io::Error| SequenceError::Read {
                file: format!("{}/{folder}", self.name),
                reason: explain(&e, "folder"),
            };
            for entry in fs::read_dir(self.root.join(&folder)).map_err(failed)? {
                let entry = entry.map_err(failed)?;
                // No layout has names that are not Unicode.
                let Ok(base) = entry.file_name().into_string() else { continue };
                let below = format!("{folder}{base}");
                let kind = entry.file_type().map_err(failed)?;
                if kind.is_symlink() {
                    let target = entry.path().canonicalize().ok();
                    let inside = target.filter(|t| t.starts_with(&self.root) && t.is_file());
                    match inside {
                        Some(_) => drop(self.files.insert(below)),
                        None => self.skipped_links.push(below),
                    }
                } else if kind.is_dir() {
                    folders.push(below + "/");
                } else if kind.is_file() {
                    self.files.insert(below);
                }
                if self.files.len() > MAX_FILES {
                    return Err(SequenceError::Read {
                        file: self.name.clone(),
                        reason: format!("more than {MAX_FILES} files: not a recording's folder"),
                    });
                }
            }
        }
        self.skipped_links.sort();
        Ok(())
    }
}

impl Source for FolderSource {
    fn name(&self) -> &str {
        &self.name
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        Ok(self.files.iter().cloned().collect())
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        let failed =
            |reason: String| SequenceError::Read { file: format!("{}/{file}", self.name), reason };
        // Only names that were listed, so that nothing in a file can lead out of the folder.
        if !self.files.contains(file) {
            let is_link = self.skipped_links.iter().any(|l| {
                file.strip_prefix(l.as_str()).is_some_and(|r| r.is_empty() || r.starts_with('/'))
            });
            return Err(failed(match is_link {
                true => "behind a link that leads out of the folder; copy or mount it".into(),
                false => "no such file when the folder was listed".into(),
            }));
        }
        let path = match file.strip_prefix("../") {
            Some(above) => self.root.parent().unwrap_or(&self.root).join(above),
            None => self.root.join(file),
        };
        let size = fs::metadata(&path).map_err(|e| failed(explain(&e, "file")))?.len();
        if size > MAX_FILE_BYTES {
            return Err(failed(format!("{size} bytes, expected at most {MAX_FILE_BYTES}")));
        }
        fs::read(&path).map_err(|e| failed(explain(&e, "file")))
    }
}

/// The usual failures in plain words.
fn explain(error: &io::Error, what: &str) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => format!("no such {what}"),
        io::ErrorKind::PermissionDenied => format!("no permission to read this {what}"),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, PathBuf) {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("scene");
        fs::create_dir_all(inner.join("results/deep")).unwrap();
        fs::write(inner.join("b.txt"), "b").unwrap();
        fs::write(inner.join("results/a.txt"), "a").unwrap();
        fs::write(inner.join("results/deep/c.txt"), "c").unwrap();
        fs::write(outer.path().join("secret.txt"), "s").unwrap();
        (outer, inner)
    }

    fn error(result: Result<impl Sized, SequenceError>) -> String {
        result.err().expect("an error").to_string()
    }

    #[test]
    fn lists_sorted_and_reads_what_was_listed() {
        let (outer, inner) = folder();
        let source = FolderSource::open(&inner).unwrap();
        assert_eq!(source.list().unwrap(), ["b.txt", "results/a.txt", "results/deep/c.txt"]);
        assert_eq!(source.read("results/deep/c.txt").unwrap(), b"c");
        assert!(source.name().ends_with("scene"));
        for outside in ["../secret.txt", "/etc/hostname", "results/../b.txt", "nothing"] {
            assert!(error(source.read(outside)).contains(outside), "{outside}");
        }
        fs::write(outer.path().join(SHARED), "{}").unwrap();
        let source = FolderSource::open(&inner).unwrap();
        assert_eq!(source.read("../cam_params.json").unwrap(), b"{}");
        fs::remove_file(inner.join("b.txt")).unwrap();
        assert!(error(source.read("b.txt")).contains("no such file"));
    }

    #[test]
    fn what_is_no_folder_is_said() {
        let (_outer, inner) = folder();
        assert!(error(FolderSource::open(&inner.join("nowhere"))).contains("no such folder"));
        let e = error(FolderSource::open(&inner.join("b.txt")));
        assert!(e.contains("b.txt") && e.contains("a folder with a recording is expected"), "{e}");
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_nowhere_else() {
        use std::os::unix::fs::symlink;
        let (outer, inner) = folder();
        symlink(outer.path().join("secret.txt"), inner.join("out.txt")).unwrap();
        symlink(outer.path(), inner.join("loop")).unwrap();
        symlink(inner.join("b.txt"), inner.join("in.txt")).unwrap();
        let source = FolderSource::open(&inner).unwrap();
        assert_eq!(source.skipped_links(), ["loop", "out.txt"]);
        assert_eq!(source.read("in.txt").unwrap(), b"b");
        for file in ["out.txt", "loop/secret.txt"] {
            assert!(error(source.read(file)).contains("link"), "{file}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn permission_is_named() {
        use std::os::unix::fs::PermissionsExt;
        let (_outer, inner) = folder();
        let (file, below) = (inner.join("b.txt"), inner.join("results"));
        let set = |path: &Path, mode| {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
        };
        set(&file, 0);
        if fs::read(&file).is_ok() {
            println!("skipped: this user may read everything");
            return;
        }
        let source = FolderSource::open(&inner).unwrap();
        assert!(error(source.read("b.txt")).contains("no permission"));
        set(&below, 0);
        let e = error(FolderSource::open(&inner));
        set(&below, 0o755);
        assert!(e.contains("results") && e.contains("no permission"), "{e}");
    }
}
