//! TUM RGB-D: lists of time-stamped files, associated by time.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    stamps::{self, WINDOW_S, associate},
    wanted::Wanted,
};
use crate::{
    entries::{Entries, Entry},
    folder::{Folder, invalid, parse_numbers, plural, shortened},
    intrinsics::{Distortion, Intrinsics},
    order::FrameOrder,
    pose_text::of_quaternion,
};
use mte_slam_types::{pose::Pose, sequence::SequenceError};

const COLOR_LIST: &str = "rgb.txt";
const DEPTH_LIST: &str = "depth.txt";
const TRUTH: &str = "groundtruth.txt";

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
        [COLOR_LIST, DEPTH_LIST].map(|file| (file, folder.has(file).into())).into()
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        read(folder, wanted)
    }
}

/// Colour and depth of one moment.
struct Moment {
    time_s: f64,
    color: String,
    depth: String,
}

/// Reads the lists and the ground truth.
fn read(folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let colors = file_list(folder, COLOR_LIST)?;
    let depths = file_list(folder, DEPTH_LIST)?;
    let moments = match wanted.order {
        FrameOrder::File => by_line(colors, depths, &mut warnings)?,
        _ => by_time(colors, depths, &mut warnings)?,
    };
    let times: Vec<f64> = moments.iter().map(|m| m.time_s).collect();
    let truths = if folder.has(TRUTH) {
        truths(ground_truth(folder, TRUTH)?, &times, wanted.order, &mut warnings)
    } else {
        warnings.push(format!("no {TRUTH}"));
        vec![None; moments.len()]
    };
    let frames = moments.into_iter().zip(truths).enumerate();
    let frames = frames.map(|(i, (m, truth))| {
        Entry::stamped(i as u64, m.time_s, m.color.into(), m.depth.into(), truth)
    });
    let frames = frames.collect();
    let intrinsics =
        wanted.camera_or(folder, || Ok(known_camera(&folder.name(), &mut warnings)))?;
    Ok(Entries {
        frames,
        intrinsics,
        depth_unit_m: 1.0 / 5000.0,
        invalid_depth: None,
        bounds: None,
        warnings,
    })
}

type List = Vec<(f64, String)>;

/// Pairs images by their stamps.
fn by_time(
    mut colors: List,
    mut depths: List,
    warnings: &mut Vec<String>,
) -> Result<Vec<Moment>, SequenceError> {
    for (list, files) in [(COLOR_LIST, &mut colors), (DEPTH_LIST, &mut depths)] {
        warnings.extend(stamps::disorder(list, &times_of(files)));
        files.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let (listed, listed_depths) = (colors.len(), depths.len());
    let partners = associate(&times_of(&colors), &times_of(&depths));
    let pairs = colors.into_iter().zip(partners);
    let moments: Vec<Moment> = pairs
        .filter_map(|((time_s, color), depth)| {
            let depth = std::mem::take(&mut depths[depth?].1);
            Some(Moment { time_s, color, depth })
        })
        .collect();
    if moments.is_empty() {
        return Err(invalid(
            COLOR_LIST,
            None,
            "time stamps",
            format!("{} and {listed_depths} but no pair", plural(listed, "colour")),
            format!("colour and depth within {WINDOW_S} s of each other (or --order file)"),
        ));
    }
    let alone = listed - moments.len();
    if alone > 0 {
        let images = plural(alone, "colour image");
        warnings.push(format!("{images} without depth within {WINDOW_S} s left out"));
    }
    Ok(moments)
}

/// Pairs images by the lines of the lists. Their times are the stamps of the list where these
/// rise, or else those that the files are named by, or else the frames are counted.
fn by_line(
    colors: List,
    depths: List,
    warnings: &mut Vec<String>,
) -> Result<Vec<Moment>, SequenceError> {
    if colors.is_empty() || colors.len() != depths.len() {
        let found = format!("{} in {COLOR_LIST}", plural(colors.len(), "image"));
        let expected = format!("as many as in {DEPTH_LIST}, {}, and some", depths.len());
        return Err(invalid(DEPTH_LIST, None, "lines, in the order of the file", found, expected));
    }
    let listed = times_of(&colors);
    let named: Option<Vec<f64>> = colors.iter().map(|c| stamps::in_name(&c.1)).collect();
    let (times, from) = match named {
        _ if stamps::rise(&listed) => (listed, "the list's stamps"),
        Some(named) if stamps::rise(&named) => (named, "the names of the images"),
        _ => ((0..colors.len()).map(|i| i as f64).collect(), "counting"),
    };
    warnings.push(format!("frames in the order of the lists, their times by {from}"));
    let pairs = times.into_iter().zip(colors).zip(depths);
    Ok(pairs.map(|((time_s, (_, color)), (_, depth))| Moment { time_s, color, depth }).collect())
}

fn times_of<T>(list: &[(f64, T)]) -> Vec<f64> {
    list.iter().map(|entry| entry.0).collect()
}

/// Returns the pose of each frame: the nearest in time, or where none fits and the order of the
/// lines is wanted, that of its line.
fn truths(
    listed: Vec<(f64, Option<Pose>)>,
    times: &[f64],
    order: FrameOrder,
    warnings: &mut Vec<String>,
) -> Vec<Option<Pose>> {
    let mut sorted = listed.clone();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let sorted_times = times_of(&sorted);
    let partners = associate(times, &sorted_times);
    if partners.iter().any(Option::is_some) || listed.is_empty() {
        return partners.into_iter().map(|p| sorted[p?].1).collect();
    }
    let poses = plural(listed.len(), "pose");
    let mut said = format!("{TRUTH}: {poses}, none within {WINDOW_S} s of a colour image");
    if let Some(how) = stamps::explanation(times, &sorted_times) {
        said += &format!("; they would fit {how}");
    }
    let as_many = listed.len() == times.len();
    if as_many && order == FrameOrder::File {
        warnings.push(said + "; taken line by line, for there are as many as frames");
        return listed.into_iter().map(|(_, pose)| pose).collect();
    }
    if as_many {
        said += "; there are as many as frames: --order file takes them line by line";
    }
    warnings.push(said);
    vec![None; times.len()]
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

/// `stamp file` per line, in the order of the file.
fn file_list(folder: &Folder, list: &str) -> Result<List, SequenceError> {
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
    Ok(files)
}

/// `stamp tx ty tz qx qy qz qw` per line, in the order of the file; poses that are not finite, or
/// whose quaternion is 0, are `None`: so some programs say that they have none.
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
        let pose = of_quaternion([x, y, z], [qx, qy, qz, qw]);
        let (Ok(pose), true) = (pose, stamp.is_finite()) else {
            let expected = "a finite stamp and a quaternion of length 1";
            return Err(invalid(file, None, format!("line {n}"), shortened(line), expected));
        };
        poses.push((stamp, pose));
    }
    Ok(poses)
}

#[cfg(test)]
mod tests {
    use super::*;

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
