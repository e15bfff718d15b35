//! A plain folder of colour and depth images whose camera is given.
use super::{
    entries::{Entries, Entry, trajectory},
    folder::{Folder, invalid, parse_matrix, plural},
    intrinsics::{self, Intrinsics},
    layout::COLOR_ENDS,
};
use mte_slam_types::{pose::Pose, sequence::SequenceError};
use std::collections::{BTreeMap, BTreeSet};

const COLOR_FOLDERS: [&str; 7] = ["color", "colour", "rgb", "image", "images", "left", "frames"];
const DEPTH_FOLDERS: [&str; 2] = ["depth", "depths"];
const POSE_FOLDERS: [&str; 2] = ["pose", "poses"];
const POSE_FILES: [&str; 4] = ["traj.txt", "traj_w_c.txt", "poses.txt", "trajectory.txt"];

/// Colour images, in the order of the numbers in their names.
pub(super) fn colors(folder: &Folder) -> Vec<&str> {
    listed(folder, &COLOR_FOLDERS, &COLOR_ENDS)
}

/// Depth images, likewise.
pub(super) fn depths(folder: &Folder) -> Vec<&str> {
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
pub(super) fn read(folder: &Folder, given: Option<Intrinsics>) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let pairs = paired(folder, &mut warnings)?;
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
    for (frame, truth) in frames.iter_mut().zip(poses(folder, &numbers)?) {
        frame.truth = truth;
    }
    let intrinsics = match (given, intrinsics::read(folder)?) {
        (Some(given), read) => {
            Intrinsics { depth_scale: read.and_then(|r| r.depth_scale), ..given }
        }
        (None, Some(read)) => read,
        (None, None) => {
            let expected = "intrinsics.json, or the numbers on the command line";
            return Err(invalid(&folder.name(), None, "camera", "nothing", expected));
        }
    };
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

/// A file a frame in `pose/`, or a line a frame.
fn poses(folder: &Folder, frames: &[u64]) -> Result<Vec<Option<Pose>>, SequenceError> {
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
    match POSE_FILES.into_iter().find(|f| folder.has(f)) {
        Some(file) => trajectory(folder, file, frames),
        None => Ok(vec![None; frames.len()]),
    }
}

/// The last part of a path.
fn base(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// All numbers in a name; digits beyond what a u64 holds are cut off.
fn numbers(name: &str) -> Vec<u64> {
    let runs = name.split(|c: char| !c.is_ascii_digit()).filter(|r| !r.is_empty());
    runs.map(|r| r.parse().unwrap_or(u64::MAX)).collect()
}

/// The last number in a file's name.
pub(super) fn last_number(name: &str) -> Option<u64> {
    let stem = base(name);
    numbers(stem.rsplit_once('.').map_or(stem, |(s, _)| s)).last().copied()
}
