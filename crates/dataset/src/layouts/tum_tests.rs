//! Lists with stamps that are no times, and poses that fit none.
use crate::{FrameOrder, MemorySource, OpenOptions, open, test_support::*};
use mte_slam_types::sequence::Sequence;

/// The tiny recording with other lists: lines by frame, each of stamp and number of the image.
fn listed(lines: &[(&str, usize)], truth: &str) -> MemorySource {
    let mut m = renamed(5, crate::Layout::Tum);
    for (list, folder) in [("rgb.txt", "rgb"), ("depth.txt", "depth")] {
        let line = |(stamp, i): &(&str, usize)| format!("{stamp} {folder}/{i}.png\n");
        m.insert(list, lines.iter().map(line).collect::<String>());
    }
    m.insert("groundtruth.txt", truth);
    m
}

fn opened_in(m: &MemorySource, order: FrameOrder) -> Box<dyn Sequence> {
    open(Box::new(m.clone()), OpenOptions { order, ..Default::default() }).unwrap()
}

/// The pictures by their numbers.
fn pictures(s: &mut dyn Sequence) -> Vec<u16> {
    (0..s.info().frames).map(|i| s.frame(i).unwrap().depth[1] - 150).collect()
}

fn poses(stamps: &[f64]) -> String {
    stamps.iter().map(|t| format!("{t} {t} 0 0 0 0 0 1\n")).collect()
}

#[test]
fn durations_are_said_and_the_order_of_the_file_is_kept_on_demand() {
    let lines = [("0.03", 0), ("0.01", 1), ("0.02", 2), ("0.01", 3), ("0.04", 4)];
    let m = listed(&lines, &poses(&[100.0, 101.0, 102.0, 103.0, 104.0]));
    let mut s = opened_in(&m, FrameOrder::Time);
    assert_eq!(pictures(s.as_mut()), [1, 3, 2, 0, 4]);
    let said = s.warnings().join("\n");
    for part in ["depth.txt: of 5 time stamps (0.01 to 0.04 s) 2 are smaller", "--order file"] {
        assert!(said.contains(part), "{part} is not in {said}");
    }
    assert!(said.contains("5 poses, none within 0.02 s") && said.contains("line by line"));
    let mut s = opened_in(&m, FrameOrder::File);
    assert_eq!(pictures(s.as_mut()), [0, 1, 2, 3, 4]);
    assert_eq!((s.time_s(3), s.number(3)), (3.0, 3));
    let said = s.warnings().join("\n");
    assert!(said.contains("their times by counting") && said.contains("taken line by line"));
    assert_eq!(s.truth(3).unwrap().translation.x, 103.0);
    // One pose too few: none is taken by its line.
    let m = listed(&lines, &poses(&[100.0, 101.0, 102.0, 103.0]));
    let s = opened_in(&m, FrameOrder::File);
    assert!((0..5).all(|i| s.truth(i).is_none()));
    // Lists of different lengths have no lines that belong together.
    let mut m = m;
    m.insert("depth.txt", "0.03 depth/0.png\n");
    let options = OpenOptions { order: FrameOrder::File, ..Default::default() };
    let e = error_of(&m, options);
    assert!(e.contains("5 images in rgb.txt") && e.contains("depth.txt, 1"), "{e}");
}

#[test]
fn stamps_in_the_names_of_the_images_are_better_than_none() {
    let mut m = renamed(3, crate::Layout::Tum);
    for kind in ["rgb", "depth"] {
        let mut list = String::new();
        for i in 0..3 {
            let bytes = m.remove(&format!("{kind}/{i}.png")).unwrap();
            m.insert(format!("{kind}/10{i}.5.png"), bytes);
            list += &format!("0.0{} {kind}/10{i}.5.png\n", 5 - i);
        }
        m.insert(format!("{kind}.txt"), list);
    }
    m.insert("groundtruth.txt", poses(&[100.501, 101.502, 102.51]));
    let s = opened_in(&m, FrameOrder::File);
    assert_eq!((s.time_s(0), s.time_s(2)), (100.5, 102.5));
    assert_eq!(s.truth(1).unwrap().translation.x, 101.502);
}

#[test]
fn poses_in_other_units_and_poses_that_are_none() {
    let lines = [("100.0", 0), ("100.5", 1), ("101.0", 2), ("101.5", 3), ("102.0", 4)];
    let ms: Vec<f64> = (0..5).map(|i| 100_000.0 + 500.0 * f64::from(i)).collect();
    let s = opened_in(&listed(&lines, &poses(&ms)), FrameOrder::Time);
    let said = s.warnings().join("\n");
    let part = "5 poses, none within 0.02 s of a colour image; they would fit in milliseconds";
    assert!(said.contains(part) && said.contains("no ground-truth poses"), "{said}");
    // A quaternion of zeros is no pose, and anything else without length 1 is a mistake.
    let truth = poses(&[100.0, 101.0]) + "100.5 1 2 3 0 0 0 0\n";
    let s = opened_in(&listed(&lines, &truth), FrameOrder::Time);
    let known: Vec<bool> = (0..5).map(|i| s.truth(i).is_some()).collect();
    assert_eq!(known, [true, false, true, false, false]);
    assert!(s.warnings().join(";").contains("3 frames without a ground-truth pose"));
    let e = error_of(&listed(&lines, "100.5 1 2 3 0 0 0 0.5\n"), OpenOptions::default());
    assert!(e.contains("groundtruth.txt") && e.contains("quaternion of length 1"), "{e}");
}
