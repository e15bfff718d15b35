//! A plain folder of colour and depth images whose camera is given.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    entries::{Entries, Entry, places, trajectory},
    folder::{COLOR_ENDS, Folder, base, invalid, last_number, numbers, plural},
    intrinsics::IMAGES_CAMERA,
    pose_text::{parse_log, parse_matrix},
};
use mte_slam_types::{pose::Pose, sequence::SequenceError};
use std::collections::{BTreeMap, BTreeSet};

const COLOR_FOLDERS: [&str; 7] = ["color", "colour", "rgb", "image", "images", "left", "frames"];
const DEPTH_FOLDERS: [&str; 2] = ["depth", "depths"];
const POSE_FOLDERS: [&str; 2] = ["pose", "poses"];
const POSE_FILES: [&str; 4] = ["traj.txt", "traj_w_c.txt", "poses.txt", "trajectory.txt"];
/// Names that other things have, too: what does not fit is said and left.
const PERHAPS_POSES: [&str; 4] = ["trajectory.log", "traj.log", "pose.txt", "pose.log"];

pub(super) struct Images;

impl LayoutFiles for Images {
    fn name(&self) -> &'static str {
        "images"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "",
            color: "`color/`, `rgb/` or `images/`",
            depth: "`depth/*.png`, mm unless the camera says",
            poses: "`pose/0.txt`, `traj.txt`, `poses.txt`, `trajectory.log`",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, camera_given: bool) -> Vec<Mark> {
        let camera = camera_given || folder.here_or_above(IMAGES_CAMERA).is_some();
        vec![
            ("color|rgb|images/<name>.jpg|png", colors(folder).len()),
            ("depth/<name>.png", depths(folder).len()),
            ("intrinsics.json (or a camera given)", camera.into()),
        ]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        read(folder, wanted)
    }

    /// Most recordings with a list or poses of their own are such folders, too.
    fn is_last_resort(&self) -> bool {
        true
    }
}

/// Colour images, in the order of the numbers in their names.
fn colors(folder: &Folder) -> Vec<&str> {
    listed(folder, &COLOR_FOLDERS, &COLOR_ENDS)
}

/// Returns depth images, likewise.
fn depths(folder: &Folder) -> Vec<&str> {
    listed(folder, &DEPTH_FOLDERS, &[".png"])
}

/// The files of the first of some folders that has any.
fn listed<'a>(folder: &'a Folder, folders: &[&str], ends: &[&str]) -> Vec<&'a str> {
    for wanted in folders {
        let mut files: Vec<&str> = folder
            .names()
            .filter(|n| {
                n.split_once('/').is_some_and(|(top, base)| {
                    top == *wanted && !base.contains('/') && ends.iter().any(|e| base.ends_with(e))
                })
            })
            .collect();
        if !files.is_empty() {
            files.sort_by_key(|n| numbers(base(n)));
            return files;
        }
    }
    Vec::new()
}

/// Reads everything but the images.
fn read(folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let pairs = paired(folder, wanted.strict, &mut warnings)?;
    let distinct: BTreeSet<u64> = pairs.iter().filter_map(|(c, _)| last_number(c)).collect();
    let numbered = distinct.len() == pairs.len();
    let mut frames: Vec<Entry> = pairs
        .into_iter()
        .enumerate()
        .map(|(i, (color, depth))| {
            let number = last_number(color).filter(|_| numbered).unwrap_or(i as u64);
            Entry::of_files(number, color.into(), depth.into(), None)
        })
        .collect();
    let numbers: Vec<u64> = frames.iter().map(|f| f.number).collect();
    let poses = poses(folder, &numbers, &mut warnings)?;
    for (frame, truth) in frames.iter_mut().zip(poses) {
        frame.truth = truth;
    }
    let intrinsics = wanted.camera_or(folder, || {
        let expected = "intrinsics.json, or the numbers on the command line";
        Err(invalid(&folder.name(), None, "camera", "nothing", expected))
    })?;
    Ok(Entries {
        frames,
        intrinsics,
        depth_unit_m: 1e-3,
        invalid_depth: None,
        bounds: None,
        warnings,
    })
}

/// Colour and depth with the same numbers in their names, or else, where there are as many of
/// both, in the same place of their orders.
fn paired<'a>(
    folder: &'a Folder,
    strict: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<(&'a str, &'a str)>, SequenceError> {
    let (colors, depths) = (colors(folder), depths(folder));
    let keyed = |files: &[&'a str]| -> BTreeMap<Vec<u64>, &'a str> {
        files.iter().map(|n| (numbers(base(n)), *n)).collect()
    };
    let (by_color, by_depth) = (keyed(&colors), keyed(&depths));
    let pairs: Vec<(&str, &str)> =
        by_color.iter().filter_map(|(k, c)| Some((*c, *by_depth.get(k)?))).collect();
    // Names without distinct numbers cannot be told apart by them.
    let distinct = by_color.len() == colors.len() && by_depth.len() == depths.len();
    if distinct && !pairs.is_empty() {
        let alone = colors.len() + depths.len() - 2 * pairs.len();
        if alone > 0 && strict {
            let found = format!("{} without its partner", plural(alone, "image"));
            let expected = "colour and depth for each number";
            return Err(invalid(&folder.name(), None, "images", found, expected));
        }
        if alone > 0 {
            warnings.push(format!("{} without its partner left out", plural(alone, "image")));
        }
        return Ok(pairs);
    }
    if colors.len() != depths.len() {
        return Err(invalid(
            &folder.name(),
            None,
            "images",
            format!("{} colour and {} depth images", colors.len(), depths.len()),
            "as many of both, or the same numbers in the names of both",
        ));
    }
    warnings.push("colour and depth images are paired by their order".into());
    Ok(colors.into_iter().zip(depths).collect())
}

/// Reads one file per frame in `pose/`, or one line per frame.
fn poses(
    folder: &Folder,
    frames: &[u64],
    warnings: &mut Vec<String>,
) -> Result<Vec<Option<Pose>>, SequenceError> {
    for below in POSE_FOLDERS {
        let files = folder.numbered(&format!("{below}/"), &[".txt"])?;
        if files.is_empty() {
            continue;
        }
        let one = |number: &u64| match files.get(number) {
            Some(file) => parse_matrix(file, Some(*number), &folder.text(file)?),
            None => Ok(None),
        };
        return frames.iter().map(one).collect();
    }
    if let Some(file) = POSE_FILES.into_iter().find(|f| folder.has(f)) {
        return trajectory(folder, file, frames);
    }
    for file in PERHAPS_POSES.into_iter().filter(|f| folder.has(f)) {
        let found = match file.ends_with(".log") {
            true => log(folder, file, frames),
            false => trajectory(folder, file, frames),
        };
        match found {
            Ok(poses) => return Ok(poses),
            Err(e) => warnings.push(format!("not taken as ground truth: {e}")),
        }
    }
    Ok(vec![None; frames.len()])
}

/// A log of poses, as [`trajectory`] takes lines.
fn log(folder: &Folder, file: &str, frames: &[u64]) -> Result<Vec<Option<Pose>>, SequenceError> {
    let poses = parse_log(file, &folder.text(file)?)?;
    match places(poses.len(), frames) {
        Some(places) => Ok(places.map(|place| poses[place]).collect()),
        None => {
            let found = plural(poses.len(), "pose");
            let expected = format!("{}, one for each colour image", frames.len());
            Err(invalid(file, None, "poses", found, expected))
        }
    }
}
