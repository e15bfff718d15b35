//! Recordings in every layout, written by a Python script that knows nothing of our code, read
//! back to the same frames; and the commands about recordings on them.
use crate::{
    program::{mte_slam, text},
    python,
};
use mte_slam_dataset::{ClassList, MemorySource, OpenOptions};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    classes::UNLABELLED,
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};
use serde_json::{Value, json};
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};
use tempfile::TempDir;

const FRAMES: usize = 24;
/// The frame whose pose ScanNet's layouts do not know.
const NO_POSE: usize = 1;

struct Fixtures {
    folder: TempDir,
    info: SequenceInfo,
    frames: Vec<Frame>,
}

impl Fixtures {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join("out").join(name)
    }
}

/// The fixtures, or `None` (after a message) where Python, numpy or Pillow is missing.
fn fixtures() -> Option<&'static Fixtures> {
    static MADE: OnceLock<Option<Fixtures>> = OnceLock::new();
    MADE.get_or_init(make).as_ref()
}

fn make() -> Option<Fixtures> {
    let python = python::with(&["numpy", "PIL"])?;
    let folder = tempfile::tempdir().unwrap();
    let options = SyntheticOptions { frames: FRAMES, width: 96, height: 72, ..Default::default() };
    let mut room = SyntheticSequence::new(options);
    let info = room.info().clone();
    let frames: Vec<Frame> = (0..FRAMES).map(|i| room.frame(i).unwrap()).collect();

    let raw = folder.path().join("raw");
    fs::create_dir(&raw).unwrap();
    let names: Vec<&str> = info.classes.classes.iter().map(|c| c.name.as_str()).collect();
    let poses: Vec<Vec<f64>> =
        frames.iter().map(|f| f.truth.unwrap().to_row_major().to_vec()).collect();
    let c = info.camera;
    let meta = json!({
        "width": c.width, "height": c.height, "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy,
        "depth_unit_m": info.depth_unit_m, "names": names, "poses": poses,
    });
    fs::write(raw.join("meta.json"), meta.to_string()).unwrap();
    let all =
        |bytes: &dyn Fn(&Frame) -> Vec<u8>| frames.iter().flat_map(bytes).collect::<Vec<u8>>();
    fs::write(raw.join("color.bin"), all(&|f| f.color.as_flattened().to_vec())).unwrap();
    let depth = |f: &Frame| f.depth.iter().flat_map(|d| d.to_le_bytes()).collect();
    fs::write(raw.join("depth.bin"), all(&depth)).unwrap();
    fs::write(raw.join("labels.bin"), all(&|f| f.labels.clone().unwrap())).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/fixtures_writer.py");
    let out = folder.path().join("out");
    let done = Command::new(python).arg(script).args([&raw, &out]).output().unwrap();
    assert!(done.status.success(), "{}", text(&done.stderr));
    Some(Fixtures { folder, info, frames })
}

/// All files of a folder, and those of the folders above that scenes share.
fn source(folder: &Path) -> MemorySource {
    fn add(m: &mut MemorySource, folder: &Path, below: &str) {
        for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
            let name = format!("{below}{}", entry.file_name().to_str().unwrap());
            match entry.path().is_dir() {
                true => add(m, &entry.path(), &format!("{name}/")),
                false => m.insert(name, fs::read(entry.path()).unwrap()),
            }
        }
    }
    let mut m = MemorySource::new(folder.to_str().unwrap());
    add(&mut m, folder, "");
    for shared in ["../cam_params.json", "../../scannetv2-labels.combined.tsv"] {
        if let Ok(bytes) = fs::read(folder.join(shared)) {
            m.insert(shared, bytes);
        }
    }
    m
}

/// What a layout keeps of the frames.
struct Kept {
    /// Units of depth per metre.
    units: f64,
    /// Largest difference of a colour channel, and on average.
    color: (u8, f64),
    labels: Labels,
    /// Of the poses.
    tolerance: f64,
    pose_lost: Option<usize>,
}

#[derive(PartialEq)]
enum Labels {
    None,
    Own,
    /// ScanNet's raw ids, as NYU's 40.
    Nyu40,
}

const EXACT: Kept =
    Kept { units: 1000.0, color: (0, 0.0), labels: Labels::None, tolerance: 1e-9, pose_lost: None };
const JPEG: (u8, f64) = (60, 4.0);

fn compare(name: &str, sequence: &mut dyn Sequence, kept: &Kept) {
    let f = fixtures().unwrap();
    let info = sequence.info().clone();
    assert_eq!(info.frames, FRAMES, "{name}");
    let (got, want) = (info.camera, f.info.camera);
    assert_eq!((got.width, got.height), (want.width, want.height), "{name}");
    for (a, b) in [(got.fx, want.fx), (got.fy, want.fy), (got.cx, want.cx), (got.cy, want.cy)] {
        assert!((a - b).abs() < 1e-4, "{name}: {got:?}, {want:?}");
    }
    assert!((info.depth_unit_m * kept.units - 1.0).abs() < 1e-9, "{name}: {}", info.depth_unit_m);
    let nyu40 = ClassList::nyu40().table.classes;
    for (i, want) in f.frames.iter().enumerate() {
        let got = sequence.frame(i).unwrap();
        let scaled =
            |d: &u16| (f64::from(*d) * (f.info.depth_unit_m * kept.units) + 0.5).floor() as u16;
        let depth: Vec<u16> = want.depth.iter().map(scaled).collect();
        assert!(got.depth == depth, "{name}: depth of frame {i}");

        let differences = got.color.as_flattened().iter().zip(want.color.as_flattened());
        let differences: Vec<u8> = differences.map(|(a, b)| a.abs_diff(*b)).collect();
        let mean =
            differences.iter().map(|d| f64::from(*d)).sum::<f64>() / differences.len() as f64;
        let worst = *differences.iter().max().unwrap();
        assert!(worst <= kept.color.0 && mean <= kept.color.1, "{name}: {i}: {worst}, {mean}");

        match (&got.labels, &kept.labels) {
            (None, Labels::None) => {}
            (Some(labels), _) if kept.labels != Labels::None => {
                for (l, w) in labels.iter().zip(want.labels.as_ref().unwrap()) {
                    let class = info.classes.classes.get(usize::from(*l));
                    let expected = match kept.labels {
                        Labels::Nyu40 => nyu40.get(usize::from(*w)),
                        _ => f.info.classes.classes.get(usize::from(*w)),
                    };
                    let (class, expected) = (class.map(|c| &c.name), expected.map(|c| &c.name));
                    assert_eq!(class, expected, "{name}: label of frame {i}");
                    assert!(class.is_some() || *l == UNLABELLED);
                }
            }
            _ => panic!("{name}: labels of frame {i}: {:?}", got.labels.is_some()),
        }

        assert_eq!(got.truth.is_none(), kept.pose_lost == Some(i), "{name}: pose of frame {i}");
        assert_eq!(got.truth, sequence.truth(i));
        if let Some(pose) = got.truth {
            let off = pose.compose(&want.truth.unwrap().inverse());
            let (t, r) = (off.translation.length(), off.angle_rad());
            assert!(t < kept.tolerance && r < kept.tolerance.max(1e-7), "{name}: {i}: {t} m, {r}");
        }
    }
}

#[test]
fn every_layout_is_read_back_to_the_same_frames() {
    let Some(f) = fixtures() else { return };
    let scannet = Kept { color: JPEG, labels: Labels::Nyu40, pose_lost: Some(NO_POSE), ..EXACT };
    let packed = |color| Kept { color, tolerance: 1e-5, labels: Labels::Nyu40, ..scannet };
    let cases = [
        (
            "replica/room",
            "replica",
            Kept { units: 6553.5, color: JPEG, labels: Labels::Own, ..EXACT },
        ),
        ("replica-vmap", "replica-vmap", Kept { labels: Labels::Own, ..EXACT }),
        ("tum", "tum", Kept { units: 5000.0, ..EXACT }),
        ("7scenes", "7scenes", EXACT),
        ("sens-jpg-zlib", "sens", packed(JPEG)),
        ("sens-png-raw", "sens", packed((0, 0.0))),
        ("sens-raw-zlib", "sens", packed((0, 0.0))),
        ("nerfstudio", "nerfstudio", EXACT),
        ("images", "images", EXACT),
        ("scannet/scans/scene0000_00", "scannet", scannet),
    ];
    for (name, layout, kept) in cases {
        let m = source(&f.path(name));
        let mut sequence = mte_slam_dataset::open(Box::new(m), OpenOptions::default()).unwrap();
        assert_eq!(sequence.info().layout, layout, "{name}");
        compare(name, sequence.as_mut(), &kept);
        let notes = sequence.warnings().join("; ");
        assert_eq!(notes.contains("pose"), kept.pose_lost.is_some(), "{name}: {notes}");
        if layout == "sens" {
            assert!((sequence.time_s(3) - (0.001 + 3.0 * 0.033333)).abs() < 1e-9);
        }
    }
}

#[test]
fn feature_maps_of_every_kind_are_read() {
    let Some(f) = fixtures() else { return };
    let (w, h) = (f.info.camera.width as usize, f.info.camera.height as usize);
    // Values up to 255 have steps of 1/8 in half precision.
    for (kind, tolerance) in
        [("npy-f4", 1e-4), ("npy-f2", 0.07), ("safetensors-F32", 1e-4), ("safetensors-F16", 0.07)]
    {
        let features = source(&f.path(&format!("features/{kind}")));
        let options = OpenOptions { features: Some(Box::new(features)), ..Default::default() };
        let mut sequence =
            mte_slam_dataset::open(Box::new(source(&f.path("images"))), options).unwrap();
        assert_eq!(sequence.info().feature_channels, 3, "{kind}");
        for (i, frame) in f.frames.iter().enumerate() {
            let map = sequence.frame(i).unwrap().features.unwrap();
            assert_eq!((map.channels, map.height, map.width), (3, h / 8, w / 8), "{kind}");
            for (at, found) in map.values.iter().enumerate() {
                let (channel, row, column) =
                    (at / (map.height * map.width), at / map.width % map.height, at % map.width);
                let pixels = (0..64).map(|p| (row * 8 + p / 8) * w + column * 8 + p % 8);
                let sum: f32 = pixels.map(|p| f32::from(frame.color[p][channel])).sum();
                let off = (found - sum / 64.0).abs();
                assert!(off <= tolerance, "{kind} {i}: {found} at {at}, {off} off");
            }
        }
    }
}

#[test]
fn occi_is_refused_by_name_and_raw_ids_need_no_table() {
    let Some(f) = fixtures() else { return };
    let m = source(&f.path("sens-raw-occi"));
    let e = mte_slam_dataset::open(Box::new(m), OpenOptions::default()).err().unwrap().to_string();
    for part in ["scene0000_00.sens", "compression of depth", "occi", "zlib"] {
        assert!(e.contains(part), "{e}");
    }
    let mut m = source(&f.path("sens-png-raw"));
    m.remove("scannetv2-labels.combined.tsv");
    let options = OpenOptions { only_present_classes: true, ..Default::default() };
    let sequence = mte_slam_dataset::open(Box::new(m), options).unwrap();
    let classes = &sequence.info().classes.classes;
    assert!(classes.len() > 5 && classes.iter().all(|c| c.raw_id % 97 == 3), "{classes:?}");
}

/// A command on one of the fixtures.
fn on(path: &Path, arguments: &[&str]) -> Output {
    let all = [&arguments[..1], &[path.to_str().unwrap()], &arguments[1..]].concat();
    mte_slam(path.parent().unwrap(), &all)
}

fn inspected(path: &Path, extra: &[&str]) -> Value {
    let mut arguments = vec!["inspect", "--json", "--quiet"];
    arguments.extend(extra);
    let output = on(path, &arguments);
    assert!(output.status.success(), "{}: {}", path.display(), text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn warnings(found: &Value) -> Vec<String> {
    let remarks = found["remarks"].as_array().unwrap();
    let warnings = remarks.iter().filter(|r| r["severity"] == "warning");
    warnings.map(|r| r["text"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn inspect_knows_every_layout_and_finds_nothing_wrong() {
    let Some(f) = fixtures() else { return };
    for (name, layout) in [
        ("replica/room", "replica"),
        ("replica-vmap", "replica-vmap"),
        ("tum", "tum"),
        ("7scenes", "7scenes"),
        ("scannet/scans/scene0000_00", "scannet"),
        ("scannet.zip", "scannet"),
        ("sens-jpg-zlib", "sens"),
        ("sens-jpg-zlib/scene0000_00.sens", "sens"),
        ("sens-deflated.zip", "sens"),
        ("sens-stored.zip", "sens"),
        ("nerfstudio", "nerfstudio"),
        ("images", "images"),
    ] {
        let found = inspected(&f.path(name), &["--strict"]);
        assert_eq!(found["layout"], layout, "{name}");
        assert_eq!(found["frames"], FRAMES, "{name}");
        assert_eq!(warnings(&found), Vec::<String>::new(), "{name}");
        assert!(found["agreement"]["error"].as_f64().unwrap() < 0.01, "{name}: {found}");
        let labelled = ["replica", "scannet", "sens"].iter().any(|l| layout.starts_with(l));
        assert_eq!(found["labels"].is_object(), labelled, "{name}");
        if layout == "scannet" || layout == "sens" {
            assert_eq!(found["poses"]["gaps"], json!([{"first": NO_POSE, "last": NO_POSE}]));
        }
    }
    let plain = on(&f.path("tum"), &["inspect", "--quiet"]);
    assert!(plain.stdout.is_empty());
    let plain = text(&on(&f.path("scannet.zip"), &["inspect"]).stdout);
    for part in ["layout   scannet", "24, numbers 0 to 23", "colour of 192x144", "no true pose"] {
        assert!(plain.contains(part), "{part}: {plain}");
    }
}

#[test]
fn inspect_finds_each_mistake_by_evidence() {
    let Some(f) = fixtures() else { return };
    let sens = "sens-jpg-zlib";
    let c = f.info.camera;
    let camera = format!("{} {} {} {}", c.fx, c.fy, c.cx, c.cy);
    for (name, extra, parts) in [
        ("tum", &["--depth-scale", "1000"][..], &["--depth-scale 5000"][..]),
        ("tum", &["--depth-scale", "6553.5"], &["--depth-scale 5000"]),
        (sens, &["--depth-scale", "5000"], &["--depth-scale 1000"]),
        ("replica/room", &["--depth-scale", "5000"], &["--depth-scale 6553.5"]),
        ("replica/room", &["--axes", "opengl"], &["--axes opengl"]),
        ("nerfstudio", &["--axes", "opengl"], &["--axes opengl", "OpenCV"]),
        ("nerfstudio-opencv", &[], &["--axes opengl", "OpenCV"]),
        ("tum-scalar-first", &[], &["scalar first"]),
        ("lexical-poses", &[], &["lexical order"]),
        ("images", &["--camera", &camera, "--depth-scale", "6553.5"], &["--depth-scale 1000"]),
    ] {
        let found = warnings(&inspected(&f.path(name), extra));
        assert!(!found.is_empty(), "{name} {extra:?}");
        for part in parts {
            assert!(found[0].contains(part), "{name} {extra:?}: {part} not in {found:?}");
        }
    }
    let strict = on(&f.path("lexical-poses"), &["inspect", "--strict", "--quiet"]);
    assert_eq!(strict.status.code(), Some(1), "{}", text(&strict.stderr));
    // The cure that it names is one.
    let cured = inspected(&f.path("nerfstudio-opencv"), &["--axes", "opengl", "--strict"]);
    assert!(warnings(&cured).is_empty());
    let notes = inspected(&f.path("nerfstudio"), &[])["remarks"].to_string();
    assert!(notes.contains("another order") && notes.contains("colour of 192x144"), "{notes}");
}

#[test]
fn converted_recordings_hold_the_same_frames() {
    let Some(f) = fixtures() else { return };
    let folder = tempfile::tempdir().unwrap();
    let sources = [
        ("scannet.zip", Kept { color: JPEG, pose_lost: Some(NO_POSE), ..EXACT }, Labels::Nyu40),
        (
            "sens-stored.zip",
            Kept { tolerance: 1e-5, pose_lost: Some(NO_POSE), ..EXACT },
            Labels::Nyu40,
        ),
        ("replica-vmap", EXACT, Labels::Own),
        ("images", EXACT, Labels::None),
    ];
    for (name, kept, labels) in sources {
        for (to, tolerance) in [("replica", 1e-9), ("tum", 1e-9), ("sens", 1e-5)] {
            let out = folder.path().join(format!("{name}-{to}"));
            let target = out.to_str().unwrap();
            let done = on(&f.path(name), &["convert", target, "--to", to, "--quiet"]);
            assert!(done.status.success(), "{name} {to}: {}", text(&done.stderr));
            let mut sequence =
                mte_slam_dataset::open(Box::new(source(&out)), OpenOptions::default()).unwrap();
            assert_eq!(sequence.info().layout, to);
            let kept = Kept {
                // Millimetres are whole numbers of 1/5000 m.
                units: if to == "tum" { 5000.0 } else { kept.units },
                tolerance: kept.tolerance.max(tolerance),
                labels: match labels {
                    Labels::None => Labels::None,
                    Labels::Own => Labels::Own,
                    Labels::Nyu40 => Labels::Nyu40,
                },
                ..kept
            };
            if to == "tum" {
                // Depth was rounded to millimetres before, so compare with that.
                check_tum(name, &f.path(name), sequence.as_mut());
            } else {
                compare(&format!("{name} to {to}"), sequence.as_mut(), &kept);
            }
            let again = on(&f.path(name), &["convert", target, "--to", to]);
            assert_eq!(again.status.code(), Some(1));
            assert!(text(&again.stderr).contains("empty folder"), "{}", text(&again.stderr));
        }
    }
}

/// Five times the millimetres, and all else as in the source.
fn check_tum(name: &str, from: &Path, converted: &mut dyn Sequence) {
    if from.is_file() {
        return; // archives are read by the program alone
    }
    let mut original =
        mte_slam_dataset::open(Box::new(source(from)), OpenOptions::default()).unwrap();
    assert!((converted.info().depth_unit_m * 5000.0 - 1.0).abs() < 1e-12);
    for i in 0..FRAMES {
        let (a, b) = (original.frame(i).unwrap(), converted.frame(i).unwrap());
        let depth: Vec<u16> = a.depth.iter().map(|d| d * 5).collect();
        assert!(depth == b.depth && a.color == b.color, "{name}: frame {i}");
        assert_eq!(a.labels.is_some(), b.labels.is_some());
        let off = a.truth.unwrap().compose(&b.truth.unwrap().inverse());
        assert!(off.translation.length() < 1e-9 && off.angle_rad() < 1e-7, "{name}: {i}");
    }
}
