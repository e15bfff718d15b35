//! The development sequences, where they are there.
use super::*;
use mte_slam_types::sequence::{Sequence, SequenceError, Source};
use std::path::{Path, PathBuf};

/// Just enough of a folder for these tests; the program's own is in the native package.
struct Disk(PathBuf);

impl Source for Disk {
    fn name(&self) -> &str {
        self.0.to_str().unwrap()
    }

    fn list(&self) -> Result<Vec<String>, SequenceError> {
        let mut names = Vec::new();
        for entry in std::fs::read_dir(&self.0).unwrap().map(Result::unwrap) {
            let name = entry.file_name().into_string().unwrap();
            if !entry.file_type().unwrap().is_dir() {
                names.push(name);
                continue;
            }
            for inner in std::fs::read_dir(entry.path()).unwrap().map(Result::unwrap) {
                names.push(format!("{name}/{}", inner.file_name().into_string().unwrap()));
            }
        }
        Ok(names)
    }

    fn read(&self, file: &str) -> Result<Vec<u8>, SequenceError> {
        std::fs::read(self.0.join(file))
            .map_err(|e| SequenceError::Read { file: file.into(), reason: e.to_string() })
    }
}

fn data(name: &str) -> Option<Disk> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    let root = std::env::var("MTE_SLAM_DATA").unwrap_or_else(|_| beside.into());
    let folder = Path::new(&root).join(name);
    if folder.is_dir() {
        return Some(Disk(folder));
    }
    println!("skipped: {name} is not there (set MTE_SLAM_DATA)");
    None
}

fn opened(name: &str, scale: f64) -> Option<Box<dyn Sequence>> {
    let options = OpenOptions { scale, ..Default::default() };
    Some(open(Box::new(data(name)?), options).unwrap())
}

/// First and last frame decode, with images of the camera's size and measured depth in metres.
fn check_ends(s: &mut dyn Sequence, labels: bool) {
    let info = s.info().clone();
    for i in [0, info.frames - 1] {
        let f = s.frame(i).unwrap();
        assert_eq!((f.color.len(), f.depth.len()), (info.camera.pixels(), info.camera.pixels()));
        let measured: Vec<u16> = f.depth.iter().copied().filter(|&d| d > 0).collect();
        assert!(measured.len() * 3 > f.depth.len(), "{i}: {} measured", measured.len());
        let sum: f64 = measured.iter().map(|&d| f64::from(d) * info.depth_unit_m).sum();
        let mean = sum / measured.len() as f64;
        assert!((0.4..6.0).contains(&mean), "{i}: mean depth {mean} m");
        assert!(f.truth.is_some());
        assert_eq!(f.labels.is_some(), labels);
        if let Some(l) = f.labels {
            let known = l.iter().filter(|&&c| usize::from(c) < info.classes.len()).count();
            assert!(known * 2 > l.len(), "{i}: {known} labelled");
        }
    }
}

#[test]
fn synthetic_rooms() {
    for name in ["room-11", "office-12"] {
        let Some(mut s) = opened(name, 1.0) else { return };
        let info = s.info().clone();
        assert_eq!((info.layout, info.frames, info.name.as_str()), ("replica", 200, name));
        assert_eq!((info.camera.width, info.camera.height), (320, 240));
        assert!((info.camera.fx - 208.516).abs() < 1e-3);
        let bounds = info.bounds.unwrap();
        for i in 0..200 {
            let at = s.truth(i).unwrap().translation;
            assert!(at.cmpge(bounds.min).all() && at.cmple(bounds.max).all());
        }
        check_ends(s.as_mut(), true);
        assert_eq!(s.warnings(), Vec::<String>::new());

        let Some(noisy) = data(&format!("{name}/semantic_noisy")) else { return };
        let options = OpenOptions {
            labels: LabelSource::Folder(Box::new(noisy)),
            only_present_classes: true,
            frames: Some(20),
            ..Default::default()
        };
        let mut n = open(Box::new(data(name).unwrap()), options).unwrap();
        assert!(n.info().classes.len() < info.classes.len());
        let (a, b) = (s.frame(5).unwrap().labels.unwrap(), n.frame(5).unwrap().labels.unwrap());
        let name_of = |table: &mte_slam_types::classes::ClassTable, i: u8| {
            table.classes.get(usize::from(i)).map(|c| c.raw_id)
        };
        let same = a
            .iter()
            .zip(&b)
            .filter(|(x, y)| name_of(&info.classes, **x) == name_of(&n.info().classes, **y));
        let share = same.count() as f64 / a.len() as f64;
        assert!((0.6..0.95).contains(&share), "{share} agree");
    }
}

#[test]
fn kitchen() {
    let Some(mut s) = opened("kitchen-7scenes", 1.0) else { return };
    assert_eq!((s.info().layout, s.info().frames), ("7scenes", 150));
    assert_eq!((s.info().camera.width, s.info().camera.fx, s.info().camera.cy), (640, 585., 240.));
    check_ends(s.as_mut(), false);
    let first = s.truth(0).unwrap();
    assert!((first.translation.x + 0.3404563).abs() < 1e-6);
    let mut half = opened("kitchen-7scenes", 0.5).unwrap();
    assert_eq!((half.info().camera.width, half.info().camera.height), (320, 240));
    assert_eq!(half.info().camera, s.info().camera.downscaled(2));
    check_ends(half.as_mut(), false);
    assert_eq!(
        half.frame(3).unwrap().depth[10 * 320 + 7],
        s.frame(3).unwrap().depth[20 * 640 + 14]
    );
}

#[test]
fn cabinet() {
    let Some(mut s) = opened("cabinet-tum", 1.0) else { return };
    assert_eq!((s.info().layout, s.info().frames), ("tum", 58));
    assert_eq!((s.info().camera.fx, s.info().camera.cy), (535.4, 247.6));
    assert!(s.warnings().iter().any(|w| w.contains("freiburg3")), "{:?}", s.warnings());
    check_ends(s.as_mut(), false);
    assert!((s.time_s(0) - 1341841278.8427).abs() < 1e-6);
    assert!((s.truth(0).unwrap().translation.x + 2.5508).abs() < 1e-9);
}

/// Opens one of the small recordings that show a kind of mistake.
fn faulty(name: &str) -> Option<Box<dyn Sequence>> {
    opened(&format!("faults/{name}"), 1.0)
}

#[test]
fn hidden_and_shouted_names() {
    for name in ["mac-images", "upper-images"] {
        let Some(mut s) = faulty(name) else { return };
        assert_eq!((s.info().layout, s.info().frames), ("images", 12), "{name}");
        check_ends(s.as_mut(), false);
        assert_eq!(s.warnings(), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn an_archive_with_backslashes() {
    let Some(folder) = data("faults/mac-images") else { return };
    let archive = folder.0.parent().unwrap().join("backslash.zip");
    let file = std::fs::File::open(&archive).unwrap();
    let source = ZipSource::new("backslash.zip", file, 1 << 26).unwrap();
    let mut s = open(Box::new(source), OpenOptions::default()).unwrap();
    assert_eq!((s.info().layout, s.info().frames), ("images", 12));
    check_ends(s.as_mut(), false);
    assert_eq!(s.warnings(), Vec::<String>::new());
}

#[test]
fn cameras_that_differ_by_little() {
    let Some(mut s) = faulty("polycam-perframe") else { return };
    assert_eq!((s.info().layout, s.info().frames), ("nerfstudio", 12));
    check_ends(s.as_mut(), false);
    let said = s.warnings().join(";");
    assert!(said.contains("pixels: the median is taken for all"), "{said}");
}

#[test]
fn stamps_that_are_none_or_of_another_unit() {
    let Some(s) = faulty("durations") else { return };
    let said = s.warnings().join("\n");
    assert!(said.contains("rgb.txt: of 12 time stamps") && said.contains("durations"), "{said}");
    assert!(said.contains("--order file"), "{said}");
    let in_order = |name: &str| {
        let options = OpenOptions { order: FrameOrder::File, ..Default::default() };
        open(Box::new(data(&format!("faults/{name}")).unwrap()), options).unwrap()
    };
    let mut ordered = in_order("durations");
    check_ends(ordered.as_mut(), false);
    assert!((ordered.time_s(0) - 1305031453.359684).abs() < 1e-6);
    assert!((ordered.truth(2).unwrap().translation.x + 0.780561).abs() < 1e-6);

    let Some(s) = faulty("ms-truth") else { return };
    let said = s.warnings().join("\n");
    let part = "12 poses, none within 0.02 s of a colour image; they would fit in milliseconds";
    assert!(said.contains(part), "{said}");
    check_ends(in_order("ms-truth").as_mut(), false);
}

#[test]
fn depth_too_near_and_too_far() {
    let inspected = |name: &str| {
        let mut s = faulty(name)?;
        let opening = s.warnings().join("\n");
        let found = inspect::inspect(s.as_mut(), Default::default(), |_, _| {}).unwrap();
        Some((opening, found))
    };
    let Some((opening, found)) = inspected("mm-in-tum-notruth") else { return };
    let parts = ["half of the depth is below", "nearer than rooms are", "--depth-scale 1000"];
    assert!(parts.iter().all(|p| opening.contains(p)), "{opening}");
    let warned = |r: &&inspect::Remark| r.severity == inspect::Severity::Warning;
    let warnings: Vec<_> = found.remarks.iter().filter(warned).collect();
    assert!(parts.iter().all(|p| warnings[0].text.contains(p)), "{warnings:?}");
    for (name, range) in [("far5pct", 4.0..10.0), ("aims-2", 4.0..13.0)] {
        let Some((_, found)) = inspected(name) else { return };
        let said = format!("{name}: {:#?} {:#?}", found.depth, found.remarks);
        assert!(found.depth.far.is_some_and(|far| range.contains(&far.limit_m)), "{said}");
        assert!(found.remarks.iter().any(|r| r.text.contains("--max-depth")), "{said}");
    }
}
