//! The output folder: checked before the work starts, filled in one go at its end.
//!
//! Files are written into a hidden staging folder inside the output folder (so on the same file
//! system) and renamed into place by [`OutputFolder::publish`]. A run that fails leaves neither
//! half a result nor a mixture of two: the staging folder, and an output folder that was made for
//! the run, are removed on drop.
use anyhow::{Context, Result, bail};
use mte_slam_report::files::not_written;
pub use mte_slam_report::files::replace_file;
use std::{
    fs,
    path::{Path, PathBuf},
};

const STAGING: &str = ".partial";
/// What an interrupted run resumes from.
const RESUME: &str = mte_slam_report::files::RESUME_FOLDER;
/// Files that mark a folder as one of ours; results of a run that was killed while they were put in
/// place lie beside what it resumes from.
const MARKERS: [&str; 3] = ["metrics.json", "config.toml", RESUME];
/// What a run writes, and therefore what a new run in the same folder takes away first, so that
/// no file of the old run stays beside files of the new one. `metrics.json` is renamed last.
const OURS: [&str; 20] = [
    "metrics.json",
    "eval.json",
    "trajectory.txt",
    "trajectory_gt.txt",
    "trajectory.svg",
    "timings.csv",
    "config.toml",
    "mesh.ply",
    "mesh_semantic.ply",
    "mesh_semantic.glb",
    "classes.csv",
    "legend.png",
    "confusion.png",
    "mesh.glb",
    "objects.json",
    "objects.glb",
    "checkpoint.safetensors",
    "metrics.json.tmp",
    "renders",
    "views",
];

/// A folder being filled.
pub struct OutputFolder {
    path: PathBuf,
    /// The topmost folder that had to be made for it, to be removed if nothing is published.
    created: Option<PathBuf>,
    published: bool,
}

impl OutputFolder {
    /// Prepares `path`: it must be absent, empty, or of an earlier run, unless `force` is given;
    /// and it must be writable.
    pub fn prepare(path: &Path, force: bool) -> Result<OutputFolder> {
        if path.exists() && !path.is_dir() {
            bail!(
                "{}: the output folder: found a file of that name, expected a folder or nothing. \
                 Choose another with --out.",
                path.display()
            );
        }
        if path.is_dir() && !force {
            let mut others = Vec::new();
            let mut marked = false;
            for entry in fs::read_dir(path).with_context(|| unwritable(path))? {
                let name = entry.with_context(|| unwritable(path))?.file_name();
                let name = name.to_string_lossy().into_owned();
                marked |= MARKERS.contains(&name.as_str());
                if name != STAGING && name != RESUME {
                    others.push(name);
                }
            }
            if !others.is_empty() && !marked {
                others.sort();
                bail!(
                    "{}: the output folder: found {} that no run wrote (such as {}), expected an \
                     empty folder or one of an earlier run. Choose another with --out, or write \
                     beside what is there with --force.",
                    path.display(),
                    if others.len() == 1 {
                        "a file".to_owned()
                    } else {
                        format!("{} files", others.len())
                    },
                    others[0]
                );
            }
        }
        let created = first_missing(path);
        let folder = OutputFolder { path: path.to_owned(), created, published: false };
        // Staging of a run that was killed.
        if folder.staging().exists() {
            fs::remove_dir_all(folder.staging()).with_context(|| unwritable(path))?;
        }
        fs::create_dir_all(folder.staging()).with_context(|| unwritable(path))?;
        // Making a folder may be allowed where writing is not (quotas, read-only mounts show here).
        fs::write(folder.staging().join("probe"), b"x").with_context(|| unwritable(path))?;
        fs::remove_file(folder.staging().join("probe")).with_context(|| unwritable(path))?;
        Ok(folder)
    }

    fn staging(&self) -> PathBuf {
        self.path.join(STAGING)
    }

    /// Stages a file; `name` may hold one folder, `renders/000000.color.png`.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let target = self.staging().join(name);
        if let Some(parent) = target.parent() {
            fs::create_dir_all(parent).with_context(|| not_written(&self.path.join(name)))?;
        }
        fs::write(&target, bytes).with_context(|| not_written(&self.path.join(name)))
    }

    /// Moves everything staged into place, replacing what an earlier run left.
    pub fn publish(mut self) -> Result<()> {
        let staged = sorted_entries(&self.staging())?;
        for name in OURS {
            let old = self.path.join(name);
            let removed = if old.is_dir() {
                fs::remove_dir_all(&old)
            } else if old.exists() {
                fs::remove_file(&old)
            } else {
                Ok(())
            };
            removed
                .with_context(|| format!("{}: the old file cannot be removed", old.display()))?;
        }
        let (marker, rest): (Vec<_>, Vec<_>) =
            staged.into_iter().partition(|name| name == "metrics.json");
        for name in rest.iter().chain(&marker) {
            let target = self.path.join(name);
            fs::rename(self.staging().join(name), &target).with_context(|| not_written(&target))?;
        }
        fs::remove_dir(self.staging()).with_context(|| unwritable(&self.path))?;
        self.published = true;
        Ok(())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if self.published {
            return;
        }
        // Best effort: the error that brought us here is the one to report.
        let _ = fs::remove_dir_all(self.staging());
        if let Some(created) = &self.created {
            let mut folder = self.path.clone();
            // From the inside out, and only what is empty: nothing of anyone else's is removed.
            while fs::remove_dir(&folder).is_ok() && folder != *created && folder.pop() {}
        }
    }
}

fn sorted_entries(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| unwritable(folder))? {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}

fn first_missing(path: &Path) -> Option<PathBuf> {
    path.ancestors()
        .take_while(|p| !p.as_os_str().is_empty() && !p.exists())
        .last()
        .map(Path::to_owned)
}

fn unwritable(path: &Path) -> String {
    format!(
        "{}: the output folder cannot be written; choose another with --out or change its rights",
        path.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_run_leaves_nothing() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("a/b/c");
        let folder = OutputFolder::prepare(&out, false).unwrap();
        folder.write("renders/000000.color.png", b"x").unwrap();
        drop(folder);
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_second_run_leaves_nothing_of_the_first() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("out");
        let first = OutputFolder::prepare(&out, false).unwrap();
        first.write("renders/000000.color.png", b"x").unwrap();
        first.write("trajectory_gt.txt", b"x").unwrap();
        first.write("metrics.json", b"{}").unwrap();
        first.publish().unwrap();
        // A failed one in between changes nothing.
        let failed = OutputFolder::prepare(&out, false).unwrap();
        failed.write("metrics.json", b"half").unwrap();
        drop(failed);
        assert_eq!(fs::read(out.join("metrics.json")).unwrap(), b"{}");
        let second = OutputFolder::prepare(&out, false).unwrap();
        second.write("renders/000010.color.png", b"y").unwrap();
        second.write("metrics.json", b"{}").unwrap();
        second.publish().unwrap();
        assert_eq!(sorted_entries(&out).unwrap(), ["metrics.json", "renders"]);
        assert_eq!(sorted_entries(&out.join("renders")).unwrap(), ["000010.color.png"]);
    }

    #[test]
    fn other_peoples_files_are_kept() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("thesis.tex"), b"x").unwrap();
        let error = OutputFolder::prepare(root.path(), false).err().unwrap().to_string();
        assert!(error.contains("thesis.tex") && error.contains("--force"), "{error}");
        let folder = OutputFolder::prepare(root.path(), true).unwrap();
        folder.write("metrics.json", b"{}").unwrap();
        folder.publish().unwrap();
        assert_eq!(sorted_entries(root.path()).unwrap(), ["metrics.json", "thesis.tex"]);
    }

    #[test]
    fn a_run_killed_while_publishing_can_publish_again() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir(root.path().join(RESUME)).unwrap();
        fs::write(root.path().join("anchors.svg"), b"x").unwrap();
        let folder = OutputFolder::prepare(root.path(), false).unwrap();
        folder.write("metrics.json", b"{}").unwrap();
        folder.publish().unwrap();
        assert!(root.path().join(RESUME).is_dir(), "the resumption's to remove");
    }
}
