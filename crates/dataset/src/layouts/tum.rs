//! TUM RGB-D: lists of time-stamped files, associated by time.
use super::interface::{LayoutFiles, Mark, Parts};
use crate::{
    entries::{Entries, Entry},
    folder::{Folder, invalid, parse_numbers, plural, shortened},
    intrinsics::{self, Distortion, Intrinsics},
};
use glam::{DQuat, DVec3};
use mte_slam_types::{pose::Pose, sequence::SequenceError};

/// Largest difference between stamps that belong together \[s\].
const WINDOW_S: f64 = 0.02;

/// The three cameras of the data set: name, fx fy cx cy, distortion.
const CAMERAS: [(&str, [f64; 4], Distortion); 3] = [
    ("freiburg1", [517.3, 516.5, 318.6, 255.3], [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    ("freiburg2", [520.9, 521.0, 325.1, 249.7], [0.2312, -0.7849, -0.0033, -0.0001, 0.9172]),
    ("freiburg3", [535.4, 539.2, 320.1, 247.6], [0.0; 5]),
];

pub(super) struct Tum;

impl LayoutFiles for Tum {
    fn name(&self) -> &'static str {
        "tum"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "",
            color: "`rgb.txt`",
            depth: "`depth.txt`, 1/5000 m",
            poses: "`groundtruth.txt`",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        ["rgb.txt", "depth.txt"].map(|file| (file, folder.has(file).into())).into()
    }

    fn read(&self, folder: &Folder, _given: Option<&Intrinsics>) -> Result<Entries, SequenceError> {
        read(folder)
    }
}

/// Reads the lists and the ground truth.
fn read(folder: &Folder) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let colors = file_list(folder, "rgb.txt", &mut warnings)?;
    let depths = file_list(folder, "depth.txt", &mut warnings)?;
    let truths = if folder.has("groundtruth.txt") {
        ground_truth(folder, "groundtruth.txt")?
    } else {
        warnings.push("no groundtruth.txt".into());
        Vec::new()
    };
    let color_times: Vec<f64> = colors.iter().map(|c| c.0).collect();
    let depth_times: Vec<f64> = depths.iter().map(|d| d.0).collect();
    let truth_times: Vec<f64> = truths.iter().map(|t| t.0).collect();
    let depth_of = associate(&color_times, &depth_times);
    let truth_of = associate(&color_times, &truth_times);

    let mut frames = Vec::new();
    for (i, (time_s, color)) in colors.iter().enumerate() {
        let Some(depth) = depth_of[i] else { continue };
        let truth = truth_of[i].and_then(|t| truths[t].1);
        let (number, depth) = (frames.len() as u64, depths[depth].1.clone());
        frames.push(Entry::stamped(number, *time_s, color.clone().into(), depth.into(), truth));
    }
    if frames.is_empty() {
        return Err(invalid(
            "rgb.txt",
            None,
            "time stamps",
            format!("{} and {} but no pair", plural(colors.len(), "colour"), depths.len()),
            format!("colour and depth within {WINDOW_S} s of each other"),
        ));
    }
    let alone = colors.len() - frames.len();
    if alone > 0 {
        let images = plural(alone, "colour image");
        warnings.push(format!("{images} without depth within {WINDOW_S} s left out"));
    }
    let intrinsics = match intrinsics::read(folder)? {
        Some(from_file) => from_file,
        None => known_camera(&folder.name(), &mut warnings),
    };
    Ok(Entries {
        frames,
        intrinsics,
        depth_unit_m: 1.0 / 5000.0,
        invalid_depth: None,
        bounds: None,
        warnings,
    })
}

/// Returns the camera by the folder's name; the third, which has no distortion, when it says nothing.
fn known_camera(folder: &str, warnings: &mut Vec<String>) -> Intrinsics {
    let lower = folder.to_lowercase();
    // The innermost folder that names a camera counts.
    let named = lower.rsplit(['/', '\\']).find_map(|part| {
        CAMERAS.iter().find(|(name, ..)| {
            part.contains(name) || part.contains(&name.replace("freiburg", "fr"))
        })
    });
    let (name, focal_centre, distortion) = *named.unwrap_or_else(|| {
        warnings.push(
            "the folder's name says nothing of freiburg1, 2 or 3 and there is no camera.txt: \
             freiburg3's camera taken"
                .into(),
        );
        &CAMERAS[2]
    });
    let from = format!("TUM {name} (there is no camera.txt)");
    Intrinsics { distortion, ..Intrinsics::fixed(&from, (640, 480), focal_centre) }
}

/// Lines that are neither empty nor comments, with their number from 1.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// `stamp file` per line, sorted by stamp.
fn file_list(
    folder: &Folder,
    list: &str,
    warnings: &mut Vec<String>,
) -> Result<Vec<(f64, String)>, SequenceError> {
    let mut files = Vec::new();
    for (n, line) in lines(&folder.text(list)?) {
        let entry = line.split_once(char::is_whitespace).and_then(|(stamp, file)| {
            let stamp: f64 = stamp.parse().ok().filter(|s: &f64| s.is_finite())?;
            Some((stamp, file.trim().to_string()))
        });
        let entry = entry.ok_or_else(|| {
            invalid(list, None, format!("line {n}"), shortened(line), "a time stamp and a file")
        })?;
        files.push(entry);
    }
    if !files.is_sorted_by(|a, b| a.0 <= b.0) {
        warnings.push(format!("{list} is not in the order of its time stamps: sorted"));
    }
    files.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(files)
}

/// `stamp tx ty tz qx qy qz qw` per line, sorted by stamp; poses that are not finite are `None`.
fn ground_truth(folder: &Folder, file: &str) -> Result<Vec<(f64, Option<Pose>)>, SequenceError> {
    let mut poses = Vec::new();
    for (n, line) in lines(&folder.text(file)?) {
        let numbers = parse_numbers(file, None, line)?;
        let &[stamp, x, y, z, qx, qy, qz, qw] = numbers.as_slice() else {
            return Err(invalid(
                file,
                None,
                format!("line {n}"),
                plural(numbers.len(), "number"),
                "8: stamp tx ty tz qx qy qz qw",
            ));
        };
        let (t, q) = (DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw));
        let finite = t.is_finite() && q.is_finite();
        if !stamp.is_finite() || (finite && (q.length() - 1.0).abs() > 0.05) {
            let expected = "a finite stamp and a quaternion of length 1";
            return Err(invalid(file, None, format!("line {n}"), shortened(line), expected));
        }
        poses.push((stamp, finite.then(|| Pose::from_quaternion(t, q))));
    }
    poses.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(poses)
}

/// For each of `a` the index of its partner in `b` (both ascending): closest pairs first, each
/// used once, none further apart than the window.
fn associate(a: &[f64], b: &[f64]) -> Vec<Option<usize>> {
    // Enough for any real rate, and a bound on the work for lists full of equal stamps.
    const NEIGHBOURS: usize = 16;
    let mut pairs = Vec::new();
    for (i, &t) in a.iter().enumerate() {
        let at = b.partition_point(|&s| s < t);
        for j in at.saturating_sub(NEIGHBOURS)..(at + NEIGHBOURS).min(b.len()) {
            let gap = (b[j] - t).abs();
            // Stamps are large: allow for the last bits of their difference.
            if gap <= WINDOW_S + 1e-6 {
                pairs.push((gap, i, j));
            }
        }
    }
    pairs.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)).then(p.2.cmp(&q.2)));
    let mut partner = vec![None; a.len()];
    let mut taken = vec![false; b.len()];
    for (_, i, j) in pairs {
        if partner[i].is_none() && !taken[j] {
            partner[i] = Some(j);
            taken[j] = true;
        }
    }
    partner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_stamps_pair_up_once() {
        let a = [1.0, 1.03, 1.06, 2.0, 3.0];
        let b = [0.985, 1.022, 1.035, 2.03, 3.02];
        assert_eq!(associate(&a, &b), [Some(0), Some(2), None, None, Some(4)]);
        // Both want the same one; the closer wins and the other takes what is left.
        assert_eq!(associate(&[1.0, 1.01], &[1.009, 1.02]), [Some(1), Some(0)]);
        assert_eq!(associate(&[1.0], &[]), [None]);
    }

    #[test]
    fn the_camera_is_known_by_the_folder() {
        let mut notes = Vec::new();
        let desk = known_camera("/data/rgbd_dataset_freiburg1_desk", &mut notes);
        assert_eq!((desk.focal_centre[0], desk.distortion[0]), (517.3, 0.2624));
        let xyz = known_camera("C:\\fr3\\fr2_xyz", &mut notes);
        assert_eq!(xyz.focal_centre[0], 520.9);
        assert!(notes.is_empty());
        assert_eq!(known_camera("cabinet", &mut notes).focal_centre[0], 535.4);
        assert!(notes[0].contains("freiburg3"));
    }
}
