//! What each layout boils down to: a list of frames with file names, and a camera.
use super::{
    folder::{Folder, invalid, parse_matrix, plural},
    intrinsics::{self, Intrinsics},
    layout::{COLOR_ENDS, Layout, SEVEN_COLOR_ENDS},
    stored::Stored,
};
use glam::DVec3;
use mte_slam_types::{frame::Bounds, pose::Pose, sequence::SequenceError};
use std::collections::BTreeMap;

/// One frame before its images are decoded.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub number: u64,
    pub time_s: f64,
    pub color: Stored,
    pub depth: Stored,
    pub label: Option<String>,
    pub truth: Option<Pose>,
}

impl Entry {
    /// A frame whose images are files of their own, and that has no time stamp.
    pub fn of_files(number: u64, color: String, depth: String, truth: Option<Pose>) -> Entry {
        let (color, depth) = (color.into(), depth.into());
        Entry { number, time_s: number as f64, color, depth, label: None, truth }
    }
}

/// The depth image that belongs to a colour image, or an error that says how it would be called.
pub(super) fn depth_of(
    depths: &BTreeMap<u64, String>,
    number: u64,
    color: &str,
    start: &str,
) -> Result<String, SequenceError> {
    let example = depths.values().next().map_or(start, String::as_str);
    depths.get(&number).cloned().ok_or_else(|| SequenceError::Read {
        file: format!("{start}{number}.png"),
        reason: format!("missing: {color} has no depth image (they look like {example})"),
    })
}

/// A recording before its images are decoded.
pub(super) struct Entries {
    pub frames: Vec<Entry>,
    pub intrinsics: Intrinsics,
    pub depth_unit_m: f64,
    /// A depth value besides 0 that means "no measurement".
    pub invalid_depth: Option<u16>,
    pub bounds: Option<Bounds>,
    pub warnings: Vec<String>,
}

/// Reads everything but the images.
pub(super) fn read(
    folder: &Folder,
    layout: Layout,
    given: Option<Intrinsics>,
) -> Result<Entries, SequenceError> {
    let mut entries = match layout {
        Layout::ReplicaNice => replica(
            folder,
            folder.numbered("results/frame", &COLOR_ENDS)?,
            folder.numbered("results/depth", &[".png"])?,
            "results/depth",
            1.0 / 6553.5,
        )?,
        Layout::ReplicaVmap => replica(
            folder,
            folder.numbered("rgb/rgb_", &COLOR_ENDS)?,
            folder.numbered("depth/depth_", &[".png"])?,
            "depth/depth_",
            1e-3,
        )?,
        Layout::Tum => super::tum::read(folder)?,
        Layout::SevenScenes => seven_scenes(folder)?,
        Layout::ScanNet => super::scannet::read(folder)?,
        Layout::Sens => super::sens::read(folder)?,
        Layout::Nerfstudio => super::nerfstudio::read(folder)?,
        Layout::Images => super::images::read(folder, given.clone())?,
    };
    if let Some(given) = given {
        let depth_scale = entries.intrinsics.depth_scale;
        entries.intrinsics = Intrinsics { depth_scale, ..given };
    }
    if let Some(scale) = entries.intrinsics.depth_scale {
        entries.depth_unit_m = 1.0 / scale;
    }
    entries.bounds = bounds(folder)?;
    let unposed = entries.frames.iter().filter(|e| e.truth.is_none()).count();
    if unposed == entries.frames.len() {
        entries.warnings.push("no ground-truth poses: the trajectory cannot be scored".into());
    } else if unposed > 0 {
        let frames = plural(unposed, "frame");
        entries.warnings.push(format!("{frames} without a ground-truth pose: masked in scores"));
    }
    Ok(entries)
}

/// Both Replica renders.
fn replica(
    folder: &Folder,
    colors: BTreeMap<u64, String>,
    depths: BTreeMap<u64, String>,
    depth_start: &str,
    depth_unit_m: f64,
) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let numbers: Vec<u64> = colors.keys().copied().collect();
    let poses = ["traj.txt", "traj_w_c.txt"].into_iter().find(|f| folder.has(f));
    let poses = match poses {
        Some(file) => trajectory(folder, file, &numbers)?,
        None => {
            warnings.push("neither traj.txt nor traj_w_c.txt".into());
            vec![None; numbers.len()]
        }
    };
    let mut frames = Vec::with_capacity(numbers.len());
    for ((number, color), truth) in colors.into_iter().zip(poses) {
        let depth = depth_of(&depths, number, &color, depth_start)?;
        frames.push(Entry::of_files(number, color, depth, truth));
    }
    let surplus = depths.len() - frames.len();
    if surplus > 0 {
        warnings
            .push(format!("{} without a colour image left out", plural(surplus, "depth image")));
    }
    let intrinsics = intrinsics::read(folder)?.unwrap_or_else(|| {
        warnings.push("no cam_params.json: Replica's usual camera taken (1200x680, f 600)".into());
        let from = "Replica (there is no cam_params.json)";
        Intrinsics::fixed(from, (1200, 680), [600.0, 600.0, 599.5, 339.5])
    });
    let (invalid_depth, bounds) = (None, None);
    Ok(Entries { frames, intrinsics, depth_unit_m, invalid_depth, bounds, warnings })
}

/// One pose a line. As many lines as images: line i belongs to the i-th image. More lines (when
/// only some of the images were kept): line n belongs to image number n.
pub(super) fn trajectory(
    folder: &Folder,
    file: &str,
    numbers: &[u64],
) -> Result<Vec<Option<Pose>>, SequenceError> {
    let text = folder.text(file)?;
    let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
    let by_number = lines.len() != numbers.len();
    let fits = numbers.last().is_none_or(|&last| last < lines.len() as u64);
    if by_number && !fits {
        return Err(invalid(
            file,
            None,
            "poses",
            plural(lines.len(), "line"),
            format!("{}, one for each colour image", plural(numbers.len(), "line")),
        ));
    }
    let line_of = |(i, &number): (usize, &u64)| if by_number { number as usize } else { i };
    numbers
        .iter()
        .enumerate()
        .map(|(i, number)| parse_matrix(file, Some(*number), lines[line_of((i, number))]))
        .collect()
}

/// 7-Scenes: all files of a frame side by side.
fn seven_scenes(folder: &Folder) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let colors = folder.numbered("frame-", &SEVEN_COLOR_ENDS)?;
    let depths = folder.numbered("frame-", &[".depth.png"])?;
    let poses = folder.numbered("frame-", &[".pose.txt"])?;
    let mut frames = Vec::with_capacity(colors.len());
    for (number, color) in colors {
        let depth = depths.get(&number).cloned().ok_or_else(|| SequenceError::Read {
            file: format!("frame-{number:06}.depth.png"),
            reason: format!("missing: {color} has no depth image"),
        })?;
        let truth = match poses.get(&number) {
            Some(file) => parse_matrix(file, Some(number), &folder.text(file)?)?,
            None => None,
        };
        frames.push(Entry::of_files(number, color, depth, truth));
    }
    let intrinsics = intrinsics::read(folder)?.unwrap_or_else(|| {
        warnings.push("no camera-intrinsics.txt: f 585, centre 320 240 taken".into());
        let from = "7-Scenes (there is no camera-intrinsics.txt)";
        Intrinsics::fixed(from, (640, 480), [585.0, 585.0, 320.0, 240.0])
    });
    Ok(Entries {
        frames,
        intrinsics,
        depth_unit_m: 1e-3,
        invalid_depth: Some(65535),
        bounds: None,
        warnings,
    })
}

/// `bound.json`: {"bound": [[x0, x1], [y0, y1], [z0, z1]]}.
fn bounds(folder: &Folder) -> Result<Option<Bounds>, SequenceError> {
    const FILE: &str = "bound.json";
    if !folder.has(FILE) {
        return Ok(None);
    }
    let json = folder.json(FILE)?;
    let number = |axis: usize, side: usize| json.get("bound")?.get(axis)?.get(side)?.as_f64();
    let corner = |side| Some(DVec3::new(number(0, side)?, number(1, side)?, number(2, side)?));
    match (corner(0), corner(1)) {
        (Some(min), Some(max)) if min.cmplt(max).all() && (max - min).is_finite() => {
            Ok(Some(Bounds { min, max }))
        }
        _ => {
            let mut found = json.to_string();
            if let Some((end, _)) = found.char_indices().nth(120) {
                found.truncate(end);
            }
            let expected = r#"{"bound": [[x0, x1], [y0, y1], [z0, z1]]}, each pair ascending"#;
            Err(invalid(FILE, None, "bound", found, expected))
        }
    }
}
