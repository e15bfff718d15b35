//! `mte-slam synth`: the built-in sequence as files, in the layout of NICE-SLAM's Replica render.
use crate::{args::SynthArgs, input, screen::Screen};
use anyhow::{Context, Result, bail};
use mte_slam_core::{
    dataset::{ColorFormat, ReplicaWriter},
    mesh::write_ply,
    sequence::Sequence,
};
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Write the built-in sequence to a folder.
pub fn run(args: &SynthArgs, screen: Screen) -> Result<()> {
    let target = Target::prepare(&args.dir)?;
    let mut sequence = input::built_in(args.frames, args.width);
    let info = sequence.info().clone();
    let mut progress = screen.progress("writing frames", args.frames);
    // PNG, so that a run on the files sees exactly what `demo` sees.
    let mut writer =
        ReplicaWriter::new(&info, ColorFormat::Png, |name, bytes| target.write(name, bytes));
    for index in 0..args.frames {
        writer.write(&sequence.frame(index)?)?;
        progress.set(index as u64 + 1, String::new);
    }
    writer.finish()?;
    progress.finish();
    let mesh = input::true_mesh(sequence.ground_truth_mesh()).mesh;
    let ply = write_ply(&mesh).context("the true mesh cannot be written")?;
    target.write("mesh.ply", &ply).context("mesh.ply: cannot be written")?;
    target.publish()?;
    let json = serde_json::json!({ "folder": args.dir, "frames": args.frames });
    let text = format!(
        "{} frames of {}x{} written to {dir}; next: mte-slam run {dir}\n",
        args.frames,
        info.camera.width,
        info.camera.height,
        dir = args.dir.display()
    );
    screen.result(&text, &format!("{json:#}\n"));
    Ok(())
}

/// A folder that appears whole or not at all: filled beside its place, then renamed.
struct Target {
    dir: PathBuf,
    staging: PathBuf,
}

impl Target {
    fn prepare(dir: &Path) -> Result<Target> {
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
        let target = Target { dir: dir.to_owned(), staging: dir.with_file_name(hidden) };
        if target.staging.exists() {
            fs::remove_dir_all(&target.staging)
                .with_context(|| format!("{name}: an earlier attempt cannot be removed"))?;
        }
        fs::create_dir_all(&target.staging)
            .with_context(|| format!("{name}: cannot be written; choose another folder"))?;
        Ok(target)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let path = self.staging.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(path, bytes)
    }

    fn publish(self) -> Result<()> {
        // An empty folder in its place gives way (renaming over one is not portable).
        let _ = fs::remove_dir(&self.dir);
        fs::rename(&self.staging, &self.dir)
            .with_context(|| format!("{}: cannot be written", self.dir.display()))
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        // Gone already when it was published.
        let _ = fs::remove_dir_all(&self.staging);
    }
}
