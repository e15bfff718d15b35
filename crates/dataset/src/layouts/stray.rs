//! Stray Scanner, an app for phones with a depth sensor, with the frames of its film taken out. Its
//! poses are those that the phone estimated.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    decode::Size,
    entries::{Entries, Entry, depth_of},
    folder::{COLOR_ENDS, Folder, invalid, parse_numbers, plural, shortened},
    intrinsics::{Intrinsics, checked},
    pose_text::of_quaternion,
    resize::same_aspect,
};
use mte_slam_types::{pose::Pose, sequence::SequenceError};
use std::collections::BTreeMap;

const CAMERA: &str = "camera_matrix.csv";
const ODOMETRY: &str = "odometry.csv";
/// The size of the film, whose camera it is \[pixels\].
const FILM: Size = (1920, 1440);

pub(super) struct Stray;

impl LayoutFiles for Stray {
    fn name(&self) -> &'static str {
        "stray"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "Stray Scanner",
            color: "`rgb/000000.jpg`, taken out of `rgb.mp4`",
            depth: "`depth/000000.png`, mm",
            poses: "none; the phone's estimates in `odometry.csv`",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![
            (CAMERA, folder.has(CAMERA).into()),
            (ODOMETRY, folder.has(ODOMETRY).into()),
            ("depth/<number>.png", folder.count("depth/", &[".png"])),
            (
                "rgb/<number>.jpg|png (ffmpeg -i rgb.mp4 -q:v 2 -start_number 0 rgb/%06d.jpg)",
                folder.count("rgb/", &COLOR_ENDS),
            ),
        ]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        read(folder, wanted)
    }
}

/// Reads everything but the images.
fn read(folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let colors = folder.numbered("rgb/", &COLOR_ENDS)?;
    let depths = folder.numbered("depth/", &[".png"])?;
    let mut rows = odometry(&folder.text(ODOMETRY)?)?;
    let mut frames = Vec::with_capacity(colors.len());
    for (number, color) in colors {
        let depth = depth_of(&depths, number, "depth/", ".png");
        let mut entry = Entry::of_files(number, color, depth, None);
        if let Some(row) = rows.remove(&number) {
            (entry.time_s, entry.prior) = (row.time_s, row.pose);
        } else {
            entry.time_s = f64::NAN;
        }
        frames.push(entry);
    }
    // Stamps of some of the frames alone would stand beside numbers.
    if !frames.is_sorted_by(|a, b| a.time_s < b.time_s) || frames.iter().any(|f| f.time_s.is_nan())
    {
        warnings
            .push(format!("{ODOMETRY}: not a rising time stamp for each frame: they are counted"));
        frames.iter_mut().for_each(|f| f.time_s = f.number as f64);
    }
    let posed = frames.iter().filter(|f| f.prior.is_some()).count();
    if posed > 0 {
        let poses = plural(posed, "pose");
        warnings.push(format!(
            "{ODOMETRY}: {poses} of the phone, which are estimates and no ground truth"
        ));
    }
    let intrinsics = wanted.camera_or(folder, || camera(folder, frames.first()))?;
    let (invalid_depth, bounds) = (None, None);
    Ok(Entries { frames, intrinsics, depth_unit_m: 1e-3, invalid_depth, bounds, warnings })
}

/// Reads the camera, which is that of the film, though its frames may have been made smaller.
fn camera(folder: &Folder, first: Option<&Entry>) -> Result<Intrinsics, SequenceError> {
    let numbers = parse_numbers(CAMERA, None, &folder.text(CAMERA)?.replace(',', " "))?;
    let &[fx, _, cx, _, fy, cy, _, _, _] = numbers.as_slice() else {
        let found = plural(numbers.len(), "number");
        return Err(invalid(CAMERA, None, "camera", found, "the 9 numbers of a 3x3 matrix"));
    };
    let mut size = FILM;
    if let Some(first) = first.filter(|f| folder.has(&f.color.file)) {
        let found = first.color.size(folder, first.number, "colour image")?;
        let of_film = (0.8..=1.25).contains(&(2.0 * cx / f64::from(FILM.0)));
        if !(of_film && same_aspect(found, FILM)) {
            size = found;
        }
    }
    let camera = Intrinsics::fixed(CAMERA, size, [fx, fy, cx, cy]);
    checked(CAMERA, Intrinsics { scales: true, ..camera })
}

/// What the phone says of a frame.
struct Row {
    time_s: f64,
    pose: Option<Pose>,
}

/// Reads the table by the names of its columns, of which newer versions of the app have more.
fn odometry(text: &str) -> Result<BTreeMap<u64, Row>, SequenceError> {
    const COLUMNS: [&str; 9] = ["timestamp", "frame", "x", "y", "z", "qx", "qy", "qz", "qw"];
    let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
    let header = lines.next().map_or("", |(_, line)| line);
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let mut places = [0; 9];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        *place = names.iter().position(|n| n.eq_ignore_ascii_case(column)).ok_or_else(|| {
            let expected = format!("a column {column}, of {}", COLUMNS.join(", "));
            invalid(ODOMETRY, None, "header", shortened(header), expected)
        })?;
    }
    let mut rows = BTreeMap::new();
    for (i, line) in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let error = |expected: &str| {
            let field = format!("line {}", i + 1);
            Err(invalid(ODOMETRY, None, field, shortened(line), expected))
        };
        let mut numbers = [0.0; 9];
        for (number, place) in numbers.iter_mut().zip(places) {
            let Some(n) = cells.get(place).and_then(|cell| cell.parse::<f64>().ok()) else {
                return error("a number in each column");
            };
            *number = n;
        }
        let [time_s, frame, x, y, z, qx, qy, qz, qw] = numbers;
        if !(0.0..=1e15).contains(&frame) || frame.fract() != 0.0 {
            return error("the number of a frame");
        }
        let Ok(pose) = of_quaternion([x, y, z], [qx, qy, qz, qw]) else {
            return error("a quaternion of length 1");
        };
        if rows.insert(frame as u64, Row { time_s, pose }).is_some() {
            return error("one line for each frame");
        }
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use crate::{Layout, MemorySource, OpenOptions, test_support::*};

    fn with(file: &str, text: &str) -> MemorySource {
        let mut m = renamed(3, Layout::Stray);
        m.remove("cam_params.json");
        m.insert(file, text);
        m
    }

    #[test]
    fn the_camera_is_that_of_the_film_or_of_its_frames() {
        let s = opened(&with(super::CAMERA, "20, 0, 11.5\n0, 21, 7.25\n0,0,1")).unwrap();
        assert_eq!((s.info().camera, s.info().depth_unit_m), (info().camera, 1e-3));
        let e = error_of(&with(super::CAMERA, "20, 0, 11.5"), OpenOptions::default());
        assert!(e.contains("camera_matrix.csv") && e.contains("3 numbers"), "{e}");
        // Frames made smaller: the numbers are still those of the film.
        let mut m = with(super::CAMERA, "1600,0,959.5\n0,1600,719.5\n0,0,1");
        let mut bytes = Vec::new();
        let small =
            image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(32, 24, image::Luma([900]));
        small.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
        for i in 0..3 {
            m.insert(format!("rgb/{i:06}.png"), bytes.clone());
            m.insert(format!("depth/{i:06}.png"), bytes.clone());
            m.remove(&format!("semantic_class/semantic_class_{i}.png"));
        }
        let c = opened(&m).unwrap().info().camera;
        assert!((c.fx - 1600.0 / 60.0).abs() < 1e-9 && (c.cx - 15.5).abs() < 1e-9, "{c:?}");
    }

    #[test]
    fn poses_are_the_phones_and_no_truth() {
        let s = opened(&renamed(3, Layout::Stray)).unwrap();
        assert_eq!((s.truth(1), s.prior(3)), (None, None));
        let off = s.prior(1).unwrap().compose(&frame(1).truth.unwrap().inverse());
        assert!(off.translation.length() < 1e-9 && off.angle_rad() < 1e-6);
        assert!((s.time_s(2) - 100.0 - 2.0 / 30.0).abs() < 1e-3);
        let said = s.warnings().join(";");
        assert!(
            said.contains("3 poses of the phone") && said.contains("no ground-truth"),
            "{said}"
        );
        // Newer versions of the app have more columns, and older ones may lack a frame.
        let table = "timestamp, frame, qx, qy, qz, qw, x, y, z, fx\n\
                     5.0, 000000, 0, 0, 0, 1, 1, 2, 3, 9\n6.0, 000002, 0, 0, 0, 0, 1, 2, 3,\n";
        let s = opened(&with(super::ODOMETRY, table)).unwrap();
        assert_eq!(s.prior(0).unwrap().translation.to_array(), [1.0, 2.0, 3.0]);
        assert_eq!((s.prior(1), s.prior(2), s.time_s(2)), (None, None, 2.0));
        assert!(s.warnings().join(";").contains("they are counted"));
        for (table, part) in [
            ("frame, x", "a column timestamp"),
            ("timestamp,frame,x,y,z,qx,qy,qz,qw\n1,0,0,0,0,0,0,0", "line 2"),
            ("timestamp,frame,x,y,z,qx,qy,qz,qw\n1,0,0,0,0,0,0,0,2", "length 1"),
            ("timestamp,frame,x,y,z,qx,qy,qz,qw\n1,0.5,0,0,0,0,0,0,1", "the number of a frame"),
            ("timestamp,frame,x,y,z,qx,qy,qz,qw\n1,0,0,0,0,0,0,0,1\n2,0,0,0,0,0,0,0,1", "one line"),
        ] {
            let e = error_of(&with(super::ODOMETRY, table), OpenOptions::default());
            assert!(e.contains("odometry.csv") && e.contains(part), "{part}: {e}");
        }
    }
}
