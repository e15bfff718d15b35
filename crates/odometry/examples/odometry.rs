//! Trajectory error of the odometry alone on the recordings below a folder.
//!
//! `odometry FOLDER [key=value ...]`: every folder in FOLDER that is a recording (see
//! `mte_slam_dataset`). A key is a path into [`OdometryConfig`] such as `references=2` or
//! `align.max_points=20000`, or one of `only=room` (part of the name), `frames=40`, `scale=0.5` (by
//! default images wider than 400 pixels are halved), `verbose=1`, `out=FOLDER`.
use mte_slam_dataset::{LabelSource, OpenOptions};
use mte_slam_metrics::{PosePair, ate};
use mte_slam_odometry::{Odometer, OdometryConfig, RgbdPyramid};
use mte_slam_types::{
    pose::Pose,
    sequence::{Sequence, SequenceError, Source},
    settings,
};
use std::{
    error::Error,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

/// The files of a folder and of the folders in it.
struct Files {
    name: String,
    root: PathBuf,
}

impl Source for Files {
    fn name(&self) -> &str {
        &self.name
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        let failed = |e: std::io::Error| SequenceError::Read {
            file: self.name.clone(),
            reason: e.to_string(),
        };
        let mut files = Vec::new();
        let mut folders = vec![String::new()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(self.root.join(&folder)).map_err(failed)? {
                let entry = entry.map_err(failed)?;
                let name = format!("{folder}{}", entry.file_name().to_string_lossy());
                if entry.file_type().map_err(failed)?.is_dir() {
                    folders.push(name + "/");
                } else {
                    files.push(name);
                }
            }
        }
        Ok(files)
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        fs::read(self.root.join(file))
            .map_err(|e| SequenceError::Read { file: file.into(), reason: e.to_string() })
    }
}

fn open(
    root: &Path,
    frames: Option<usize>,
    scale: f64,
) -> Result<Box<dyn Sequence>, SequenceError> {
    let files = Files { name: root.display().to_string(), root: root.into() };
    let labels = LabelSource::None;
    mte_slam_dataset::open(
        Box::new(files),
        OpenOptions { frames, scale, labels, ..OpenOptions::default() },
    )
}

struct Options {
    only: String,
    frames: Option<usize>,
    scale: Option<f64>,
    verbose: bool,
    out: Option<PathBuf>,
    odometry: OdometryConfig,
}

fn options(args: impl Iterator<Item = String>) -> Result<Options, Box<dyn Error>> {
    let mut options = Options {
        only: String::new(),
        frames: None,
        scale: None,
        verbose: false,
        out: None,
        odometry: OdometryConfig::default(),
    };
    for arg in args {
        let (key, value) = arg.split_once('=').ok_or_else(|| format!("{arg}: not key=value"))?;
        match key {
            "only" => options.only = value.into(),
            "frames" => options.frames = Some(value.parse()?),
            "scale" => options.scale = Some(value.parse()?),
            "verbose" => options.verbose = value == "1",
            "out" => options.out = Some(PathBuf::from(value)),
            _ => {
                settings::set(&mut options.odometry, key, serde_json::from_str(value)?)?;
            }
        }
    }
    Ok(options)
}

/// Tracks one recording and prints its line of the table.
fn measure(name: &str, mut sequence: Box<dyn Sequence>, o: &Options) -> Result<(), Box<dyn Error>> {
    let info = sequence.info().clone();
    let mut odometer = Odometer::new(o.odometry.clone());
    let mut online: Vec<Pose> = Vec::new();
    let (mut seconds, mut prepare, mut lost, mut recovered) = (0.0, 0.0, 0, 0);
    for i in 0..info.frames {
        let frame = sequence.frame(i)?;
        let first = if i == 0 { frame.truth } else { None };
        let start = Instant::now();
        let unit = info.depth_unit_m;
        let pyramid = RgbdPyramid::new(&frame, &info.camera, unit, &o.odometry.pyramid)?;
        prepare += start.elapsed().as_secs_f64();
        let result = odometer.track(pyramid, first)?;
        seconds += start.elapsed().as_secs_f64();
        lost += usize::from(result.lost);
        recovered += usize::from(result.recovered);
        online.push(result.world_from_camera);
        if let (true, Some(truth)) = (o.verbose, frame.truth) {
            let q = result.quality;
            let e = truth.inverse().compose(&result.world_from_camera);
            let step = |from: Option<Pose>, to: Pose| {
                from.map_or(0.0, |p| 100.0 * (to.translation - p.translation).length())
            };
            let before = i.checked_sub(1);
            println!(
                "{i:4} step {:.2} {:.2} cm err {:6.2} cm {:5.2} deg  inl {:.2} ovl {:.2} g {:.2} mm p {:.4} cond {:.1e} refs {} {} {}",
                step(before.and_then(|j| sequence.truth(j)), truth),
                step(before.map(|j| online[j]), online[i]),
                100.0 * e.translation.length(),
                e.angle_rad().to_degrees(),
                q.inlier_ratio,
                q.overlap,
                1e3 * q.geometric_rmse_m,
                q.photometric_rmse,
                q.conditioning,
                q.references,
                if result.keyframe.is_some() { "K" } else { "" },
                result.reason.map_or(String::new(), |r| format!("{r:?}")),
            );
        }
    }
    let last: Vec<Pose> = odometer.trajectory().iter().map(|t| t.1).collect();
    if let Some(out) = &o.out {
        // One line per frame: estimate, then truth, both `world_from_camera`, 3x4 row by row.
        let mut text = String::new();
        for (i, estimate) in last.iter().enumerate() {
            let Some(truth) = sequence.truth(i) else { continue };
            for x in [*estimate, truth].iter().flat_map(|p| p.to_row_major()[..12].to_vec()) {
                write!(text, "{x} ")?;
            }
            text.push('\n');
        }
        fs::write(out.join(format!("{name}.txt")), text)?;
    }
    if o.verbose {
        println!("colour registration {:?}", odometer.color_registration());
    }
    let error = |poses: &[Pose]| {
        let pairs: Vec<PosePair> = (poses.iter().enumerate())
            .filter_map(|(i, p)| Some(PosePair { estimate: *p, truth: sequence.truth(i)? }))
            .collect();
        ate(&pairs)
    };
    let (after, during) = (error(&last)?.aligned_cm, error(&online)?.aligned_cm);
    let per_frame = 1e3 / info.frames.max(1) as f64;
    println!(
        "| {name} | {} | {:.3} | {:.3} | {:.3} | {:.1} | {:.1} | {lost} | {recovered} | {} | {:.3} |",
        info.frames,
        after.rmse,
        during.rmse,
        after.max,
        per_frame * seconds,
        per_frame * prepare,
        odometer.keyframes().len(),
        odometer.color_registration().scale,
    );
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let Some(data) = args.next() else {
        return Err("usage: odometry FOLDER [key=value ...]".into());
    };
    let options = options(args)?;
    let mut folders: Vec<PathBuf> =
        fs::read_dir(&data)?.map(|e| Ok(e?.path())).collect::<Result<_, std::io::Error>>()?;
    folders.retain(|f| f.is_dir());
    folders.sort();
    println!(
        "| sequence | frames | ATE cm | online cm | max cm | ms/frame | pyramid ms | lost | recovered | keyframes | colour scale |"
    );
    println!("|{}", " --- |".repeat(11));
    for folder in folders {
        let name = folder.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
        if !name.contains(&options.only) {
            continue;
        }
        let wide = |s: &dyn Sequence| s.info().camera.width > 400;
        let opened =
            match (open(&folder, options.frames, options.scale.unwrap_or(1.0)), options.scale) {
                (Ok(s), None) if wide(&*s) => open(&folder, options.frames, 0.5),
                (opened, _) => opened,
            };
        match opened {
            Ok(sequence) => measure(&name, sequence, &options)?,
            Err(e) => println!("| {name} | {e} |"),
        }
    }
    Ok(())
}
