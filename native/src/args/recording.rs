//! Which recording is read, and how; and the commands that are about recordings alone.
use super::{SegmenterArgs, values::at_least_one};
use clap::{Args, ValueEnum, ValueHint};
use mte_slam_dataset::{GivenCamera, Layout};
use std::path::PathBuf;

/// Which part of a recording, and how it is read.
#[derive(Clone, Debug, Args)]
pub struct SelectionArgs {
    #[arg(long, value_name = "LAYOUT", help_heading = "Recording", help = layout_help())]
    pub layout: Option<String>,
    /// Take at most N frames [default: all].
    #[arg(long, value_name = "N", value_parser = at_least_one, help_heading = "Recording")]
    pub frames: Option<usize>,
    /// Take every K-th frame.
    #[arg(long, value_name = "K", default_value = "1", value_parser = at_least_one, help_heading = "Recording")]
    pub stride: usize,
    /// Skip the first I frames.
    #[arg(long, value_name = "I", default_value_t = 0, help_heading = "Recording")]
    pub start: usize,
    /// Scale the images, for example 0.5 for half the width and height.
    #[arg(long, value_name = "F", default_value = "1", value_parser = image_scale, help_heading = "Recording")]
    pub scale: f64,
    /// The sensor, where the files say nothing or are wrong.
    #[command(flatten)]
    pub sensor: SensorArgs,
    /// Labels: `none`, `dataset` (those of the recording, if any), or a folder of label images.
    #[arg(
        long,
        value_name = "none|dataset|DIR",
        default_value = "dataset",
        help_heading = "Recording"
    )]
    pub labels: String,
    /// Labels that rendered classes, and the labels of --labels themselves, are scored against;
    /// classes are matched by their ids [default: the recording's own, if it has any, else those
    /// of --labels].
    #[arg(long, value_name = "dataset|DIR|none", help_heading = "Recording")]
    pub truth_labels: Option<String>,
    /// Folder of feature maps made of the colour images by any model, such as DINOv2: 000000.npy or
    /// 000000.safetensors (the tensor `features`, or the only one), ... by frame number, float32 or float16, channels x height x width. The feature fusion reads
    /// them in place of the labels (which it is still trained by).
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath, help_heading = "Recording")]
    pub features: Option<PathBuf>,
    /// What the labels and the truth are read with.
    #[command(flatten)]
    pub classes: ClassArgs,
    /// Labels of a network.
    #[command(flatten)]
    pub segmentation: SegmenterArgs,
}

/// What the files say, or should say, about the sensor.
#[derive(Clone, Debug, Default, Args)]
pub struct SensorArgs {
    /// Camera of the depth images, instead of any file's: focal lengths and centre in pixels (the
    /// first pixel's centre is 0 0), and OpenCV's distortion if there is any. With it any folder
    /// of `color/` (or rgb/, images/) and `depth/` can be read.
    #[arg(
        long,
        value_name = "fx fy cx cy [k1 k2 p1 p2 k3]",
        value_parser = camera,
        allow_hyphen_values = true,
        help_heading = "Recording"
    )]
    pub camera: Option<GivenCamera>,
    /// Units of depth per metre, instead of what the files or their layout say: 1000 for
    /// millimetres, 5000 for TUM, 6553.5 for Replica.
    #[arg(long, value_name = "UNITS", value_parser = depth_scale, help_heading = "Recording")]
    pub depth_scale: Option<f64>,
    /// Axes of the true poses' cameras: `opengl` turns y and z (nerfstudio's are turned anyway)
    /// [default: opencv, x right, y down, z forward].
    #[arg(long, value_name = "opencv|opengl", help_heading = "Recording")]
    pub axes: Option<String>,
    /// Depth beyond M metres counts as not measured; `inspect` proposes a limit where some depth lies
    /// far beyond the rest [default: none].
    #[arg(long, value_name = "M", value_parser = depth_limit, help_heading = "Recording")]
    pub max_depth: Option<f64>,
    /// Order of the frames of lists (TUM, nerfstudio): `time`, by their stamps, or `file`, as the lines
    /// are, where stamps are no times [default: time].
    #[arg(long, value_name = "time|file", help_heading = "Recording")]
    pub order: Option<String>,
    /// Refuse a recording of which a frame lacks an image; otherwise such frames are left out, with a
    /// note.
    #[arg(long, help_heading = "Recording")]
    pub require_images: bool,
}

/// What the ids in label images mean.
#[derive(Clone, Debug, Default, Args)]
pub struct ClassArgs {
    /// Ids, names and colours of the classes: `nyu40` (ScanNet), `replica` (its 101 classes) or a
    /// file like classes.json, `{"7": {"name": "bed", "color": [86, 117, 191]}}` [default: the
    /// classes.json of the label folder or the recording, else every id that occurs].
    #[arg(long, value_name = "nyu40|replica|FILE", help_heading = "Recording")]
    pub classes: Option<String>,
    /// Id in the label images that means "no label" [default: that of the class named void,
    /// unlabelled or unlabeled; 0 for nyu40 and replica; else 255].
    #[arg(long, value_name = "ID", help_heading = "Recording")]
    pub unlabelled: Option<u16>,
}

/// `inspect`.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// Folder, .zip or .sens of the recording.
    #[arg(value_name = "DATASET", value_hint = ValueHint::AnyPath)]
    pub dataset: PathBuf,
    /// Number of frames that are examined for ranges, holes and classes.
    #[arg(long, value_name = "N", default_value = "40", value_parser = at_least_one)]
    pub look_at: usize,
    /// Number of frames that are reprojected into later ones.
    #[arg(long, value_name = "N", default_value = "12", value_parser = at_least_one)]
    pub pairs: usize,
    /// Exit with 1 when there is any warning.
    #[arg(long)]
    pub strict: bool,
    /// Which part of the recording, and how it is read.
    #[command(flatten)]
    pub selection: SelectionArgs,
}

/// `convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// Folder, .zip or .sens of the recording.
    #[arg(value_name = "DATASET", value_hint = ValueHint::AnyPath)]
    pub dataset: PathBuf,
    /// Folder to write to; must be empty or absent.
    #[arg(value_name = "OUT", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Layout to write.
    #[arg(long, value_enum, value_name = "LAYOUT")]
    pub to: TargetLayout,
    /// How colour is stored: jpg (quality 95) loses a little each time, png nothing.
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT")]
    pub color_format: ColorChoice,
    /// Which part of the recording, and how it is read.
    #[command(flatten)]
    pub selection: SelectionArgs,
}

/// `label`.
#[derive(Debug, Args)]
pub struct LabelArgs {
    /// Folder, .zip or .sens of the recording.
    #[arg(value_name = "DATASET", value_hint = ValueHint::AnyPath)]
    pub dataset: PathBuf,
    /// Folder to write to; must be empty or absent.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Which part of the recording, how it is read, and the network.
    #[command(flatten)]
    pub selection: SelectionArgs,
}

fn depth_limit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(m) if m.is_finite() && m > 0.0 => Ok(m),
        _ => Err("expected metres above 0, for example 8".to_owned()),
    }
}

fn layout_help() -> String {
    format!("Layout of the files, instead of recognizing it: {}", Layout::names())
}

/// A layout that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TargetLayout {
    /// Replica in NICE-SLAM's render: depth keeps its unit.
    Replica,
    /// TUM RGB-D: depth is rounded to 1/5000 m, and what is deeper than 13.1 m becomes a hole.
    Tum,
    /// ScanNet's packed .sens, labels beside it: depth keeps its unit, poses have single precision.
    Sens,
}

/// How colour is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    /// Small.
    Jpg,
    /// Exact.
    #[default]
    Png,
}

fn camera(text: &str) -> Result<GivenCamera, String> {
    let expected = "expected fx fy cx cy, or fx fy cx cy k1 k2 p1 p2 k3, fx and fy above 0";
    let words = text.split([' ', ',']).filter(|w| !w.is_empty());
    let numbers: Vec<f64> = words
        .map(str::parse)
        .collect::<Result<_, _>>()
        .map_err(|_| format!("found something that is no number, {expected}"))?;
    GivenCamera::from_numbers(&numbers)
        .filter(|c| c.numbers().iter().all(|x| x.is_finite()))
        .filter(|c| c.focal_centre[0] > 0.0 && c.focal_centre[1] > 0.0)
        .ok_or_else(|| format!("found {numbers:?}, {expected}"))
}

fn depth_scale(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(u) if u.is_finite() && u > 0.0 => Ok(u),
        _ => Err("expected units per metre above 0, for example 1000 for millimetres".to_owned()),
    }
}

fn image_scale(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(f) if f.is_finite() && f > 0.0 && f <= 1.0 => Ok(f),
        _ => Err("expected a factor above 0 and at most 1, for example 0.5".to_owned()),
    }
}
