//! Folders, archives and packed recordings on disk as sources of named bytes.
use mte_slam_dataset::ZipSource;
use mte_slam_types::sequence::{SequenceError, Source, too_short};
use std::{
    collections::BTreeSet,
    fs,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

/// More files than any recording has; a folder with more was not meant.
const MAX_FILES: usize = 2_000_000;
/// Larger than any file of a recording that is read as a whole \[bytes\].
const MAX_FILE_BYTES: u64 = 1 << 30;
/// Files that are also looked for above the folder, because scenes share them: Replica's camera,
/// ScanNet's table of labels.
const SHARED: [&str; 10] = [
    "../cam_params.json",
    "../../cam_params.json",
    "../intrinsics.json",
    "../../intrinsics.json",
    "../camera-intrinsics.txt",
    "../../camera-intrinsics.txt",
    "../camera.txt",
    "../../camera.txt",
    "../scannetv2-labels.combined.tsv",
    "../../scannetv2-labels.combined.tsv",
];
/// What may belong to a packed recording beside it.
const BESIDE_PACKED: [&str; 2] = ["label-filt/", "semantic_class/"];

/// A recording on disk: a folder, a `.zip`, or a `.sens`.
///
/// # Errors
/// [`SequenceError`] when it is none of them, or cannot be read.
pub fn open(path: &Path) -> Result<(Box<dyn Source>, Vec<String>), SequenceError> {
    if has_ending(path, "zip") && path.is_file() {
        let failed = |e: io::Error| SequenceError::Read {
            file: path.display().to_string(),
            reason: explain(&e, "file"),
        };
        let file = fs::File::open(path).map_err(failed)?;
        let name = path.display().to_string();
        let archive = ZipSource::new(&name, BufReader::new(file), MAX_FILE_BYTES)?;
        return Ok((Box::new(archive), Vec::new()));
    }
    let source = match has_ending(path, "sens") && path.is_file() {
        true => FolderSource::around(path)?,
        false => FolderSource::open(path)?,
    };
    let links = source.skipped_links().to_vec();
    Ok((Box::new(source), links))
}

/// Whether a file's name ends so, in any case.
pub fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// The files below a folder, listed once at opening. Links are followed only to files inside
/// the folder; outside of it only the few files can be read that scenes share.
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
            let expected = "a folder with a recording, a .zip or a .sens is expected";
            return Err(failed(format!("a file, where {expected}")));
        }
        // "." says little in messages, and the name of a TUM folder tells its camera.
        let shown = if path.file_name().is_some() { path } else { &root };
        let name = shown.display().to_string();
        let mut source = Self { name, root, files: BTreeSet::new(), skipped_links: Vec::new() };
        source.walk(vec![String::new()])?;
        source.add_shared();
        Ok(source)
    }

    /// A packed recording with the labels and lists beside it, and nothing else of its folder.
    fn around(path: &Path) -> Result<Self, SequenceError> {
        let failed =
            |reason: String| SequenceError::Read { file: path.display().to_string(), reason };
        let whole = path.canonicalize().map_err(|e| failed(explain(&e, "file")))?;
        let (Some(root), Some(base)) = (whole.parent(), whole.file_name().and_then(|n| n.to_str()))
        else {
            return Err(failed("no name of a file in Unicode".into()));
        };
        let name = path.display().to_string();
        let root = root.to_path_buf();
        let mut source = Self { name, root, files: BTreeSet::new(), skipped_links: Vec::new() };
        source.files.insert(base.into());
        let shared = SHARED.iter().filter_map(|s| s.rsplit('/').next());
        for name in shared.chain(["classes.json", "bound.json"]) {
            if source.root.join(name).is_file() {
                source.files.insert(name.into());
            }
        }
        let there = BESIDE_PACKED.iter().filter(|f| source.root.join(f).is_dir());
        source.walk(there.map(|f| (*f).to_owned()).collect())?;
        source.add_shared();
        Ok(source)
    }

    fn add_shared(&mut self) {
        for name in SHARED {
            let there = self.path_of(name);
            if fs::symlink_metadata(there).is_ok_and(|m| m.is_file()) {
                self.files.insert(name.into());
            }
        }
    }

    /// Where a listed file lies. The root has no links in it, so going up is going to its parent.
    fn path_of(&self, file: &str) -> PathBuf {
        let (mut folder, mut rest) = (self.root.as_path(), file);
        while let Some(above) = rest.strip_prefix("../") {
            (folder, rest) = (folder.parent().unwrap_or(folder), above);
        }
        folder.join(rest)
    }

    /// The path of a file that was listed, so that nothing in a file can lead out of the folder.
    fn listed(&self, file: &str) -> Result<PathBuf, SequenceError> {
        if self.files.contains(file) {
            return Ok(self.path_of(file));
        }
        let is_link = self.skipped_links.iter().any(|l| {
            file.strip_prefix(l.as_str()).is_some_and(|r| r.is_empty() || r.starts_with('/'))
        });
        Err(self.failed(
            file,
            match is_link {
                true => "behind a link that leads out of the folder; copy or mount it".into(),
                false => "no such file when the folder was listed".into(),
            },
        ))
    }

    fn failed(&self, file: &str, reason: String) -> SequenceError {
        SequenceError::Read { file: format!("{}/{file}", self.name), reason }
    }

    /// Links that were not followed, because they lead out of the folder, nowhere, or to a
    /// folder; sorted.
    pub fn skipped_links(&self) -> &[String] {
        &self.skipped_links
    }

    /// Lists what is below some folders, each empty or with a final '/'.
    fn walk(&mut self, mut folders: Vec<String>) -> Result<(), SequenceError> {
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
        let path = self.listed(file)?;
        let size = self.size(file)?;
        if size > MAX_FILE_BYTES {
            let reason = format!("{size} bytes, expected at most {MAX_FILE_BYTES}");
            return Err(self.failed(file, reason));
        }
        fs::read(&path).map_err(|e| self.failed(file, explain(&e, "file")))
    }

    fn size(&self, file: &str) -> Result<u64, SequenceError> {
        let found = fs::metadata(self.listed(file)?);
        Ok(found.map_err(|e| self.failed(file, explain(&e, "file")))?.len())
    }

    fn read_range(&self, file: &str, offset: u64, bytes: usize) -> Result<Vec<u8>, SequenceError> {
        let failed = |e: io::Error| self.failed(file, explain(&e, "file"));
        let size = self.size(file)?;
        if offset.checked_add(bytes as u64).is_none_or(|end| end > size) {
            return Err(too_short(&format!("{}/{file}", self.name), size, offset, bytes));
        }
        let mut opened = fs::File::open(self.listed(file)?).map_err(failed)?;
        opened.seek(SeekFrom::Start(offset)).map_err(failed)?;
        let mut part = vec![0; bytes];
        opened.read_exact(&mut part).map_err(failed)?;
        Ok(part)
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
        for name in ["cam_params.json", "scannetv2-labels.combined.tsv"] {
            fs::write(outer.path().join(name), "{}").unwrap();
            let source = FolderSource::open(&inner).unwrap();
            assert_eq!(source.read(&format!("../{name}")).unwrap(), b"{}");
        }
        let source = FolderSource::open(&inner.join("results")).unwrap();
        assert_eq!(source.read("../../scannetv2-labels.combined.tsv").unwrap(), b"{}");
        assert_eq!(source.read("../../cam_params.json").unwrap(), b"{}");
        assert!(error(source.read("../../secret.txt")).contains("no such file"));
        let source = FolderSource::open(&inner).unwrap();
        fs::remove_file(inner.join("b.txt")).unwrap();
        assert!(error(source.read("b.txt")).contains("no such file"));
    }

    #[test]
    fn what_is_no_folder_is_said() {
        let (_outer, inner) = folder();
        assert!(error(FolderSource::open(&inner.join("nowhere"))).contains("no such folder"));
        let e = error(FolderSource::open(&inner.join("b.txt")));
        assert!(
            e.contains("b.txt") && e.contains("a folder with a recording, a .zip or a .sens"),
            "{e}"
        );
    }

    #[test]
    fn parts_of_files_and_packed_recordings() {
        let (_outer, inner) = folder();
        fs::write(inner.join("scene.sens"), "0123456789").unwrap();
        fs::write(inner.join("classes.json"), "{}").unwrap();
        fs::create_dir(inner.join("label-filt")).unwrap();
        fs::write(inner.join("label-filt/0.png"), "x").unwrap();
        let (source, _) = open(&inner.join("scene.sens")).unwrap();
        assert_eq!(source.list().unwrap(), ["classes.json", "label-filt/0.png", "scene.sens"]);
        assert_eq!(source.size("scene.sens").unwrap(), 10);
        assert_eq!(source.read_range("scene.sens", 3, 4).unwrap(), b"3456");
        assert!(error(source.read_range("scene.sens", 8, 3)).contains("10 bytes long"));
        assert!(error(source.read_range("scene.sens", u64::MAX, 3)).contains("10 bytes long"));
        assert!(error(source.read("b.txt")).contains("no such file"));
        fs::write(inner.join("x.zip"), "PK").unwrap();
        assert!(error(open(&inner.join("x.zip")).map(drop)).contains("a zip archive"));
        assert!(error(open(&inner.join("y.zip")).map(drop)).contains("no such folder"));
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
