//! nerfstudio's `transforms.json` with depth, also in the variants of Instant-NGP and NeRFCapture.
//! Its cameras look along -z with y up (OpenGL), and its pixel (0, 0) has its centre at (1/2, 1/2);
//! both become ours here.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    entries::{Entries, Entry},
    folder::{COLOR_ENDS, Folder, invalid, last_number, plural, shortened},
    frame_camera,
    intrinsics::{Intrinsics, checked},
    order::FrameOrder,
    pose_text,
};
use mte_slam_types::{pose::Pose, sequence::SequenceError};
use serde_json::Value;
use std::collections::BTreeSet;

/// The file that makes a folder one of nerfstudio's.
const FILE: &str = "transforms.json";
/// Metres per unit of depth where the file says nothing, as in nerfstudio's own parser.
const DEPTH_UNIT_M: f64 = 1e-3;
/// The camera models that are a pinhole with (or without) the distortion that we know.
const MODELS: [&str; 6] =
    ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "SIMPLE_RADIAL", "RADIAL"];

pub(super) struct Nerfstudio;

impl LayoutFiles for Nerfstudio {
    fn name(&self) -> &'static str {
        "nerfstudio"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "",
            color: "`transforms.json`",
            depth: "there, mm unless it says",
            poses: "there, OpenGL axes",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![(FILE, folder.has(FILE).into())]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        read(folder, wanted)
    }
}

/// Reads everything but the images.
fn read(folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let json = folder.json(FILE)?;
    let listed = json.get("frames").and_then(Value::as_array).ok_or_else(|| {
        invalid(FILE, None, "frames", "nothing", "a list of frames with their file paths")
    })?;
    let first = listed
        .first()
        .ok_or_else(|| invalid(FILE, None, "frames", "an empty list", "at least one frame"))?;
    let mut intrinsics = camera(&json, first, 0)?;

    let mut frames = Vec::with_capacity(listed.len());
    let mut without_depth = 0;
    for (i, frame) in listed.iter().enumerate() {
        let number = i as u64;
        let path = |key: &str| frame.get(key).and_then(Value::as_str);
        let color = path("file_path").ok_or_else(|| {
            invalid(FILE, Some(number), "file_path", "nothing", "the path of the colour image")
        })?;
        let Some(depth) = path("depth_file_path").or_else(|| path("depth_path")) else {
            if wanted.strict {
                let expected = "depth_file_path or depth_path";
                return Err(invalid(FILE, Some(number), "depth", "nothing", expected));
            }
            without_depth += 1;
            continue;
        };
        let (color, depth) = (existing(folder, color), existing(folder, depth));
        let truth = match frame.get("transform_matrix") {
            None | Some(Value::Null) => None,
            Some(rows) => pose(number, rows)?,
        };
        let mut entry = Entry::of_files(number, color, depth, truth);
        entry.focal_centre = Some(same_lens(&intrinsics, camera(&json, frame, number)?, number)?);
        entry.time_s = frame
            .get("timestamp")
            .and_then(Value::as_f64)
            .filter(|t| t.is_finite())
            .unwrap_or(f64::NAN);
        frames.push(entry);
    }
    if frames.is_empty() {
        let found = format!("none of {}", plural(listed.len(), "frame"));
        let expected = "depth_file_path (nerfstudio) or depth_path (Instant-NGP)";
        return Err(invalid(FILE, None, "frames with depth", found, expected));
    }
    if without_depth > 0 {
        warnings.push(format!("{} without depth left out", plural(without_depth, "frame")));
    }
    in_order(&mut frames, wanted.order, &mut warnings);
    let cameras: Vec<[f64; 4]> = frames.iter().filter_map(|f| f.focal_centre).collect();
    intrinsics.focal_centre = frame_camera::median(&cameras).unwrap_or(intrinsics.focal_centre);

    let unit = |key: &str| json.get(key).map(|v| (key.to_string(), v.as_f64(), v.to_string()));
    let depth_unit_m = match unit("integer_depth_scale").or(unit("depth_unit_scale_factor")) {
        None => DEPTH_UNIT_M,
        Some((_, Some(m), _)) if m.is_finite() && m > 0.0 => m,
        Some((key, _, found)) => {
            return Err(invalid(FILE, None, key, found, "metres per unit of depth > 0"));
        }
    };
    Ok(Entries { frames, intrinsics, depth_unit_m, invalid_depth: None, bounds: None, warnings })
}

/// Frames by the numbers in the names of their files (unless the order of the list is wanted), and
/// stamped.
fn in_order(frames: &mut [Entry], order: FrameOrder, warnings: &mut Vec<String>) {
    let numbers: Vec<Option<u64>> = frames.iter().map(|f| last_number(&f.color.file)).collect();
    let distinct: BTreeSet<u64> = numbers.iter().flatten().copied().collect();
    if order == FrameOrder::File {
        frames.iter_mut().enumerate().for_each(|(i, frame)| frame.number = i as u64);
    } else if distinct.len() == frames.len() {
        for (frame, number) in frames.iter_mut().zip(numbers) {
            frame.number = number.unwrap_or(frame.number);
        }
        if !frames.is_sorted_by_key(|f| f.number) {
            warnings.push(format!("{FILE} lists the frames in another order: sorted by number"));
            frames.sort_by_key(|f| f.number);
        }
    }
    let stamped = frames.is_sorted_by(|a, b| a.time_s < b.time_s);
    if !stamped || frames.iter().any(|f| f.time_s.is_nan()) {
        frames.iter_mut().for_each(|f| f.time_s = f.number as f64);
    }
}

/// Returns fx, fy, cx and cy of a frame's camera, which may be its own (phones focus), unlike size
/// and distortion.
fn same_lens(first: &Intrinsics, own: Intrinsics, frame: u64) -> Result<[f64; 4], SequenceError> {
    let differs = |field: &str, found: String, expected: String| {
        let expected = format!("{expected}, as in the first frame");
        Err(invalid(FILE, Some(frame), field, found, expected))
    };
    if own.size != first.size {
        let shown = |i: &Intrinsics| i.size.map_or(String::new(), |(w, h)| format!("{w}x{h}"));
        return differs("w and h", shown(&own), shown(first));
    }
    if own.distortion != first.distortion {
        let shown = |i: &Intrinsics| format!("{:?}", i.distortion);
        return differs("k1 k2 p1 p2 k3", shown(&own), shown(first));
    }
    Ok(own.focal_centre)
}

/// Returns the camera, of the colour images, from the top of the file or else from a frame.
fn camera(json: &Value, frame: &Value, number: u64) -> Result<Intrinsics, SequenceError> {
    let get = |key: &str| json.get(key).or_else(|| frame.get(key));
    let invalid = |file: &str, _: Option<u64>, field: &str, found: String, expected: &str| {
        // What stands at the top is no frame's.
        let of_frame = json.get(field).is_none().then_some(number);
        invalid(file, of_frame, field, found, expected)
    };
    if let Some(model) = get("camera_model").and_then(Value::as_str)
        && !MODELS.contains(&model)
    {
        let expected = format!("a pinhole: {}", MODELS.join(", "));
        return Err(invalid(FILE, None, "camera_model", shortened(model), &expected));
    }
    let number = |key: &str| -> Result<Option<f64>, SequenceError> {
        match get(key) {
            None | Some(Value::Null) => Ok(None),
            Some(v) => match v.as_f64().filter(|x| x.is_finite()) {
                Some(x) => Ok(Some(x)),
                None => Err(invalid(FILE, None, key, v.to_string(), "a number")),
            },
        }
    };
    let side = |key: &str| -> Result<f64, SequenceError> {
        let found = number(key)?;
        found.filter(|n| (1.0..=65535.0).contains(n) && n.fract() == 0.0).ok_or_else(|| {
            let found = found.map_or("nothing".into(), |n| n.to_string());
            invalid(FILE, None, key, found, "the size of the colour images in pixels")
        })
    };
    let (w, h) = (side("w")?, side("h")?);
    let focal = |key: &str, angle: &str, side: f64| -> Result<Option<f64>, SequenceError> {
        match number(key)? {
            Some(f) => Ok(Some(f)),
            None => Ok(number(angle)?.map(|a| 0.5 * side / (0.5 * a).tan())),
        }
    };
    let fx = focal("fl_x", "camera_angle_x", w)?
        .ok_or_else(|| invalid(FILE, None, "fl_x", "nothing".into(), "fl_x or camera_angle_x"))?;
    let fy = focal("fl_y", "camera_angle_y", h)?.unwrap_or(fx);
    let centre = [number("cx")?.unwrap_or(0.5 * w), number("cy")?.unwrap_or(0.5 * h)];
    for key in ["k4", "k5", "k6"] {
        if number(key)?.is_some_and(|k| k != 0.0) {
            let found = "a number".to_string();
            return Err(invalid(FILE, None, key, found, "0: k1 k2 p1 p2 k3 are known here"));
        }
    }
    let mut distortion = [0.0; 5];
    for (value, key) in distortion.iter_mut().zip(["k1", "k2", "p1", "p2", "k3"]) {
        *value = number(key)?.unwrap_or(0.0);
    }
    let focal_centre = [fx, fy, centre[0] - 0.5, centre[1] - 0.5];
    let camera = Intrinsics::fixed(FILE, (w as u32, h as u32), focal_centre);
    checked(FILE, Intrinsics { distortion, scales: true, ..camera })
}

/// The file that a path means: relative to the folder, perhaps without its ending. Where there is
/// none, the name that it would have.
fn existing(folder: &Folder, path: &str) -> String {
    let name = path.replace('\\', "/");
    let name = name.trim_start_matches("./");
    let endings = [""].into_iter().chain(COLOR_ENDS);
    let found = endings.map(|end| format!("{name}{end}")).find(|n| folder.has(n));
    found.unwrap_or_else(|| name.into())
}

/// Rows of 4 numbers, 3 or 4 of them; camera axes turned from OpenGL's to ours.
fn pose(frame: u64, rows: &Value) -> Result<Option<Pose>, SequenceError> {
    let error = |found: String| {
        let expected = "a rigid transform of 3 or 4 rows of 4 numbers, world_from_camera";
        Err(invalid(FILE, Some(frame), "transform_matrix", found, expected))
    };
    let rows: Vec<&Vec<Value>> =
        rows.as_array().into_iter().flatten().filter_map(Value::as_array).collect();
    if !(3..=4).contains(&rows.len()) || rows.iter().any(|r| r.len() != 4) {
        return error(format!("{} rows", rows.len()));
    }
    let mut matrix = Pose::IDENTITY.to_row_major();
    for (y, row) in rows.iter().take(3).enumerate() {
        for (x, value) in row.iter().enumerate() {
            // What is no number means that there is no pose.
            let Some(number) = value.as_f64().filter(|n| n.is_finite()) else { return Ok(None) };
            matrix[4 * y + x] = number;
        }
    }
    if pose_text::is_none(&matrix) {
        return Ok(None);
    }
    match Pose::from_row_major(&matrix) {
        Some(pose) => Ok(Some(pose.with_flipped_camera())),
        None => error("a matrix whose upper left 3x3 block is not a rotation".into()),
    }
}
