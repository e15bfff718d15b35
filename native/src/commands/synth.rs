//! `mte-slam synth`: the built-in sequence as files, in the layout of NICE-SLAM's Replica render.
use crate::{args::SynthArgs, input, screen::Screen};
use anyhow::{Context, Result, bail};
use image::{
    ExtendedColorType, ImageEncoder,
    codecs::{jpeg::JpegEncoder, png::PngEncoder},
};
use mte_slam_core::{
    classes::UNLABELLED,
    frame::{Frame, SequenceInfo},
    mesh::write_ply,
    sequence::Sequence,
};
use serde_json::{Map, json};
use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

/// Write the built-in sequence to a folder.
pub fn run(args: &SynthArgs, screen: Screen) -> Result<()> {
    let target = Target::prepare(&args.dir)?;
    let mut sequence = input::built_in(args.frames, args.width);
    let info = sequence.info().clone();
    let mut progress = screen.progress("writing frames", args.frames);
    let mut poses = String::new();
    for index in 0..args.frames {
        let frame = sequence.frame(index)?;
        write_frame(&target, &info, &frame)?;
        if let Some(pose) = frame.truth {
            let numbers: Vec<String> =
                pose.to_row_major().iter().map(|x| format!("{x:.12}")).collect();
            let _ = writeln!(poses, "{}", numbers.join(" "));
        }
        progress.set(index as u64 + 1, String::new);
    }
    progress.finish();
    target.write("traj.txt", poses.as_bytes())?;
    write_description(&target, &info)?;
    let mesh = input::true_mesh(sequence.ground_truth_mesh()).mesh;
    target.write("mesh.ply", &write_ply(&mesh).context("the true mesh cannot be written")?)?;
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

fn write_frame(target: &Target, info: &SequenceInfo, frame: &Frame) -> Result<()> {
    let (w, h) = (info.camera.width, info.camera.height);
    let failed = || format!("frame {} cannot be encoded", frame.index);
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 95)
        .write_image(frame.color.as_flattened(), w, h, ExtendedColorType::Rgb8)
        .with_context(failed)?;
    target.write(&format!("results/frame{:06}.jpg", frame.index), &jpeg)?;
    let depth: Vec<u8> = frame.depth.iter().flat_map(|d| d.to_ne_bytes()).collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&depth, w, h, ExtendedColorType::L16)
        .with_context(failed)?;
    target.write(&format!("results/depth{:06}.png", frame.index), &png)?;
    if let Some(labels) = &frame.labels {
        let raw = |&l: &u8| match info.classes.classes.get(usize::from(l)) {
            Some(class) if l != UNLABELLED => class.raw_id,
            _ => 0,
        };
        let bytes: Vec<u8> = labels.iter().flat_map(|l| raw(l).to_ne_bytes()).collect();
        let mut png = Vec::new();
        PngEncoder::new(&mut png)
            .write_image(&bytes, w, h, ExtendedColorType::L16)
            .with_context(failed)?;
        let name = format!("semantic_class/semantic_class_{:06}.png", frame.index);
        target.write(&name, &png)?;
    }
    Ok(())
}

/// Camera, classes and bounds.
fn write_description(target: &Target, info: &SequenceInfo) -> Result<()> {
    let c = &info.camera;
    let camera = json!({ "camera": {
        "w": c.width, "h": c.height, "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy,
        "scale": 1.0 / info.depth_unit_m,
    }});
    target.write("cam_params.json", format!("{camera:#}\n").as_bytes())?;
    let mut classes = Map::new();
    for class in &info.classes.classes {
        classes
            .insert(class.raw_id.to_string(), json!({ "name": class.name, "color": class.color }));
    }
    let classes = serde_json::Value::Object(classes);
    target.write("classes.json", format!("{classes:#}\n").as_bytes())?;
    if let Some(b) = info.bounds {
        let sides: Vec<[f64; 2]> = (0..3).map(|k| [b.min[k], b.max[k]]).collect();
        let bound = json!({ "bound": sides });
        target.write("bound.json", format!("{bound:#}\n").as_bytes())?;
    }
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

    fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.staging.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        let shown = self.dir.join(name);
        fs::write(&path, bytes).with_context(|| format!("{}: cannot be written", shown.display()))
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
