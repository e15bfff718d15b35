//! The raw export of Polycam, an app for phones with a depth sensor: each frame has a camera file
//! with intrinsics of its own. Its poses are those that the phone estimated.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    entries::{Entries, Entry, depth_of},
    folder::{COLOR_ENDS, Folder, invalid, plural},
    frame_camera::median,
    intrinsics::{Intrinsics, checked},
    pose_text,
};
use mte_slam_types::{pose::Pose, sequence::SequenceError};
use serde_json::Value;

const COLORS: &str = "keyframes/images/";
const DEPTHS: &str = "keyframes/depth/";
const CAMERAS: &str = "keyframes/cameras/";

pub(super) struct Polycam;

impl LayoutFiles for Polycam {
    fn name(&self) -> &'static str {
        "polycam"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "Polycam's raw export",
            color: "`keyframes/images/1.jpg`",
            depth: "`keyframes/depth/1.png`, mm",
            poses: "none; the phone's estimates in `keyframes/cameras/1.json`",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![
            ("keyframes/images/<microseconds>.jpg", folder.count(COLORS, &COLOR_ENDS)),
            ("keyframes/depth/<microseconds>.png", folder.count(DEPTHS, &[".png"])),
            ("keyframes/cameras/<microseconds>.json", folder.count(CAMERAS, &[".json"])),
        ]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        read(folder, wanted)
    }
}

/// Reads everything but the images.
fn read(folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let colors = folder.numbered(COLORS, &COLOR_ENDS)?;
    let depths = folder.numbered(DEPTHS, &[".png"])?;
    let files = folder.numbered(CAMERAS, &[".json"])?;
    let there = colors.len();
    let mut frames = Vec::with_capacity(there);
    for (number, color) in colors {
        let Some(file) = files.get(&number) else { continue };
        let json = folder.json(file)?;
        let depth = depth_of(&depths, number, DEPTHS, ".png");
        let mut entry = Entry::of_files(number, color, depth, None);
        entry.time_s = number as f64 * 1e-6;
        entry.focal_centre = Some(focal_centre(file, number, &json)?);
        entry.prior = pose(file, number, &json)?;
        frames.push(entry);
    }
    let alone = there - frames.len();
    if alone > 0 && wanted.strict {
        let found = format!("{} without a camera file", plural(alone, "image"));
        return Err(invalid(CAMERAS, None, "cameras", found, "one for each image"));
    }
    if alone > 0 {
        warnings.push(format!("{} without a camera file left out", plural(alone, "image")));
    }
    let posed = frames.iter().filter(|f| f.prior.is_some()).count();
    if posed > 0 {
        let poses = plural(posed, "pose");
        warnings.push(format!("{poses} of the phone, which are estimates and no ground truth"));
    }
    let intrinsics = wanted.camera_or(folder, || {
        let cameras: Vec<[f64; 4]> = frames.iter().filter_map(|f| f.focal_centre).collect();
        let first = frames.iter().find(|f| folder.has(&f.color.file));
        let (Some(focal_centre), Some(first)) = (median(&cameras), first) else {
            return Err(invalid(CAMERAS, None, "cameras", "none", "one for each image"));
        };
        // Some exports leave the size out of the camera.
        let size = first.color.size(folder, first.number, "colour image")?;
        Ok(Intrinsics { scales: true, ..Intrinsics::fixed(CAMERAS, size, focal_centre) })
    })?;
    if intrinsics.from != CAMERAS {
        frames.iter_mut().for_each(|f| f.focal_centre = None);
    }
    let (invalid_depth, bounds) = (None, None);
    Ok(Entries { frames, intrinsics, depth_unit_m: 1e-3, invalid_depth, bounds, warnings })
}

/// Returns fx, fy, cx and cy. As in nerfstudio's files of the same recordings, the centre of pixel
/// (0, 0) is taken to be (1/2, 1/2) there; here it is (0, 0).
fn focal_centre(file: &str, frame: u64, json: &Value) -> Result<[f64; 4], SequenceError> {
    let number = |key: &str| {
        json.get(key).and_then(Value::as_f64).ok_or_else(|| {
            let found = json.get(key).map_or("nothing".into(), Value::to_string);
            invalid(file, Some(frame), key, found, "a number of pixels")
        })
    };
    let numbers = [number("fx")?, number("fy")?, number("cx")? - 0.5, number("cy")? - 0.5];
    Ok(checked(file, Intrinsics::any_size(file, numbers))?.focal_centre)
}

/// Returns the pose, whose camera has OpenGL's axes; `None` where a number is missing.
fn pose(file: &str, frame: u64, json: &Value) -> Result<Option<Pose>, SequenceError> {
    let mut matrix = Pose::IDENTITY.to_row_major();
    for (i, number) in matrix.iter_mut().take(12).enumerate() {
        let key = format!("t_{}{}", i / 4, i % 4);
        let Some(n) = json.get(&key).and_then(Value::as_f64) else { return Ok(None) };
        *number = n;
    }
    if pose_text::is_none(&matrix) {
        return Ok(None);
    }
    let pose = Pose::from_row_major(&matrix).ok_or_else(|| {
        let found = "a matrix whose left 3x3 block is not a rotation";
        invalid(file, Some(frame), "t_00 to t_23", found, "a rigid transform, world_from_camera")
    })?;
    Ok(Some(pose.with_flipped_camera()))
}

#[cfg(test)]
mod tests {
    use crate::{Layout, OpenOptions, test_support::*};

    #[test]
    fn each_frame_has_its_camera_and_the_phones_pose() {
        let mut m = renamed(3, Layout::Polycam);
        m.remove("cam_params.json");
        let s = opened(&m).unwrap();
        assert_eq!((s.info().camera, s.info().depth_unit_m), (info().camera, 1e-3));
        assert_eq!((s.truth(1), s.number(2), s.time_s(2)), (None, 2, 2e-6));
        let off = s.prior(1).unwrap().compose(&frame(1).truth.unwrap().inverse());
        assert!(off.translation.length() < 1e-9 && off.angle_rad() < 1e-6);
        let camera = "keyframes/cameras/2.json";
        let text = String::from_utf8(m.get(camera).unwrap().to_vec()).unwrap();
        let changed = |from: &str, to: &str| {
            assert!(text.contains(from), "{text}");
            let mut m = m.clone();
            m.insert(camera, text.replacen(from, to, 1));
            m
        };
        // Three pixels further right.
        let mut s = opened(&changed("\"cx\":12.0", "\"cx\":15.0")).unwrap();
        assert!(s.warnings().join(";").contains("1 frame brought into the median camera"));
        assert_eq!(s.frame(2).unwrap().depth[5], frame(2).depth[8]);
        let s = opened(&changed("\"t_00\"", "\"t\"")).unwrap();
        assert_eq!((s.prior(2), s.prior(1).is_some()), (None, true));
        for (from, to, part) in [
            ("\"cx\":12.0", "\"cx\":NaN", "(frame 2): cx: found \"NaN\""),
            ("\"fx\":20.0", "\"fx\":-20.0", "fx and fy > 0"),
            ("\"t_00\":", "\"t_00\":9", "(frame 2): t_00 to t_23"),
        ] {
            let e = error_of(&changed(from, to), OpenOptions::default());
            assert!(e.contains("2.json") && e.contains(part), "{part}: {e}");
        }
        m.remove(camera);
        let s = opened(&m).unwrap();
        assert_eq!(s.info().frames, 2);
        assert!(s.warnings().join(";").contains("1 image without a camera file left out"));
        let e = error_of(&m, OpenOptions { strict: true, ..Default::default() });
        assert!(e.contains("1 image without a camera file"), "{e}");
    }
}
