//! Tests of the sequence as a whole.
use super::{sensor::DEPTH_UNIT_M, *};
use alloc::{collections::BTreeSet, vec, vec::Vec};
use glam::DVec3;
use mte_slam_types::{
    frame::Frame,
    pose::Pose,
    sequence::{Sequence, SequenceError},
};

const KINDS: [SceneKind; 2] = [SceneKind::Room, SceneKind::Office];

fn tiny(scene: SceneKind, seed: u64, frames: usize) -> SyntheticSequence {
    SyntheticSequence::new(SyntheticOptions { scene, seed, frames, ..SyntheticOptions::tiny() })
}

/// FNV-1a over everything that a frame delivers.
fn digest(frame: &Frame) -> u64 {
    let depth = frame.depth.iter().flat_map(|d| d.to_le_bytes());
    let pose = frame.truth.into_iter().flat_map(|p| p.to_row_major());
    frame
        .color
        .iter()
        .flatten()
        .copied()
        .chain(depth)
        .chain(frame.labels.iter().flatten().copied())
        .chain(pose.flat_map(f64::to_le_bytes))
        .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3))
}

fn depth_m(frame: &Frame, i: usize) -> f64 {
    f64::from(frame.depth[i]) * DEPTH_UNIT_M
}

#[test]
fn the_seed_decides_every_byte() {
    for noise in [false, true] {
        let make = |seed| {
            let options = SyntheticOptions { seed, depth_noise: noise, ..SyntheticOptions::tiny() };
            digest(&SyntheticSequence::new(options).frame(3).unwrap())
        };
        assert_eq!(make(5), make(5));
        assert_ne!(make(5), make(6));
    }
}

/// Pinned, so that a platform, a feature set or a compiler that gives other bytes is noticed. A
/// change of the scene changes the number.
#[test]
fn the_bytes_are_those_of_every_other_platform() {
    assert_eq!(
        digest(&tiny(SceneKind::Office, 5, 12).frame(3).unwrap()),
        18_151_025_272_616_726_618
    );
}

#[test]
fn a_short_sequence_is_the_beginning_of_a_long_one_and_ends() {
    let mut short = tiny(SceneKind::Room, 1, 3);
    let mut long = tiny(SceneKind::Room, 1, 30);
    assert_eq!(digest(&short.frame(2).unwrap()), digest(&long.frame(2).unwrap()));
    assert!(short.truth(3).is_none());
    assert!(matches!(short.frame(3), Err(SequenceError::OutOfRange { index: 3, frames: 3 })));
}

#[test]
fn the_camera_moves_as_a_hand_does_and_comes_back() {
    for kind in KINDS {
        let s = tiny(kind, 0, 1000);
        let round = s.scene.path.round();
        assert!((240.0..320.0).contains(&round), "{kind:?}: a round takes {round} frames");
        let (mut moved, mut turned) = (Vec::new(), Vec::new());
        for i in 1..300 {
            let step = s.truth(i - 1).unwrap().inverse().compose(&s.truth(i).unwrap());
            moved.push(step.translation.length());
            turned.push(step.angle_rad().to_degrees());
        }
        for (values, low, median, high) in
            [(&mut moved, 0.004, 0.017, 0.032), (&mut turned, 0.3, 1.2, 2.4)]
        {
            values.sort_by(f64::total_cmp);
            let (least, mid, most) = (values[0], values[values.len() / 2], values[298]);
            assert!(least > low && most < high, "{kind:?}: {least} .. {most}");
            assert!((0.6 * median..1.6 * median).contains(&mid), "{kind:?}: median {mid}");
        }
        let (a, b) = (s.truth(0).unwrap(), s.truth(round as usize).unwrap());
        let back = a.inverse().compose(&b);
        assert!(back.translation.length() < 0.06 && back.angle_rad().to_degrees() < 4.0);
    }
}

#[cfg(feature = "hall")]
#[test]
fn the_hall_is_large_and_its_camera_flies_free() {
    let mut s = tiny(SceneKind::Hall, 1, 2000);
    let bounds = s.info().bounds.unwrap();
    let size = bounds.max - bounds.min;
    assert!((size - DVec3::new(10.2, 9.2, 8.2)).abs().max_element() < 1e-3, "{size}");
    let round = s.scene.path.round();
    assert!((1000.0..2500.0).contains(&round), "a round takes {round} frames");
    for i in (0..round as usize).step_by(25) {
        let frame = s.frame(i).unwrap();
        let known: Vec<f64> =
            (0..frame.depth.len()).map(|k| depth_m(&frame, k)).filter(|z| *z > 0.0).collect();
        assert!(known.len() * 10 > frame.depth.len() * 8, "frame {i}: {} known", known.len());
        let nearest = known.iter().copied().fold(f64::MAX, f64::min);
        assert!(nearest > 0.2, "frame {i}: {nearest} m");
    }
    let mesh = s.ground_truth_mesh();
    assert!(mesh.triangles.len() > 300_000);
}

#[test]
fn views_from_other_poses_agree_with_the_frames() {
    let mut s = tiny(SceneKind::Room, 3, 20);
    let pose = s.truth(7).unwrap();
    let (a, b) = (s.frame(7).unwrap(), s.view_from(7, &pose).unwrap());
    assert_eq!((a.color, a.depth, a.labels), (b.color, b.depth, b.labels));
    let inside_wall = Pose { translation: DVec3::new(0.0, 0.0, -0.5), ..pose };
    assert!(s.view_from(0, &inside_wall).is_none());
}

#[test]
fn every_view_is_in_range_and_every_class_is_seen() {
    for kind in KINDS {
        let mut s = tiny(kind, 2, 200);
        let classes = s.info().classes.len();
        assert_eq!(s.info().classes.index_of_raw().len(), classes, "raw ids are unique");
        let colors: BTreeSet<_> = s.info().classes.classes.iter().map(|c| c.color).collect();
        assert_eq!(colors.len(), classes, "colours are distinct");
        let mut seen = vec![0usize; classes];
        for i in (0..200).step_by(2) {
            let frame = s.frame(i).unwrap();
            let (mut nearest, mut good) = (f64::MAX, 0);
            for (k, &label) in frame.labels.as_ref().unwrap().iter().enumerate() {
                let z = depth_m(&frame, k);
                nearest = nearest.min(z);
                good += usize::from((0.3..5.0).contains(&z));
                seen[usize::from(label)] += 1;
            }
            assert!(nearest > 0.25, "{kind:?} frame {i}: {nearest} m");
            assert!(good * 10 > frame.depth.len() * 9, "{kind:?} frame {i}: {good} in range");
        }
        for (class, n) in s.info().classes.classes.iter().zip(&seen) {
            assert!(*n >= 40, "{kind:?}: {} has {n} pixels", class.name);
        }
    }
}

#[test]
fn depth_label_and_colour_agree_between_frames() {
    for kind in KINDS {
        let (width, height) = (240, 180);
        let mut s = SyntheticSequence::new(SyntheticOptions {
            scene: kind,
            width,
            height,
            frames: 120,
            ..SyntheticOptions::default()
        });
        let camera = s.info().camera;
        for i in [0, 57, 118] {
            let (a, b) = (s.frame(i).unwrap(), s.frame(i + 1).unwrap());
            let b_from_a = b.truth.unwrap().inverse().compose(&a.truth.unwrap());
            let (la, lb) = (a.labels.as_ref().unwrap(), b.labels.as_ref().unwrap());
            let (mut errors, mut same, mut shades) = (Vec::new(), 0, Vec::new());
            for k in 0..camera.pixels() {
                let (u, v) = (k as u32 % camera.width, k as u32 / camera.width);
                let p = camera.back_project(f64::from(u), f64::from(v), depth_m(&a, k));
                let p = b_from_a.transform_point(p);
                let Some(q) = camera.project(p) else { continue };
                let (x, y) = (q.x.round(), q.y.round());
                let inside = x >= 0.0
                    && y >= 0.0
                    && x < f64::from(camera.width)
                    && y < f64::from(camera.height);
                if !inside {
                    continue;
                }
                let m = y as usize * camera.width as usize + x as usize;
                errors.push((p.z - depth_m(&b, m)).abs());
                same += usize::from(la[k] == lb[m]);
                let shade = |c: [u8; 3]| c.iter().map(|&x| i32::from(x)).sum::<i32>();
                shades.push((shade(a.color[k]) - shade(b.color[m])).abs());
            }
            errors.sort_by(f64::total_cmp);
            shades.sort_unstable();
            let n = errors.len();
            assert!(n > camera.pixels() / 2);
            assert!(errors[n / 2] < 0.006, "{kind:?} {i}: {} m", errors[n / 2]);
            assert!(same * 100 > n * 90, "{kind:?} {i}: {same} of {n} labels agree");
            assert!(shades[n / 2] < 45, "{kind:?} {i}: colours differ by {}", shades[n / 2]);
        }
    }
}

/// Returns the distance of a point to a triangle \[m\].
fn triangle_distance(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let n = (b - a).cross(c - a).normalize();
    let foot = p - n * (p - a).dot(n);
    let outside = |s: DVec3, e: DVec3| (e - s).cross(foot - s).dot(n) < 0.0;
    if !outside(a, b) && !outside(b, c) && !outside(c, a) {
        return (p - foot).length();
    }
    let segment = |s: DVec3, e: DVec3| {
        let t = ((p - s).dot(e - s) / (e - s).length_squared()).clamp(0.0, 1.0);
        (p - (s + (e - s) * t)).length()
    };
    segment(a, b).min(segment(b, c)).min(segment(c, a))
}

#[test]
fn what_the_camera_sees_lies_on_the_mesh_with_its_class() {
    for kind in KINDS {
        let mut s = tiny(kind, 0, 200);
        let mesh = s.ground_truth_mesh();
        assert_eq!(mesh.triangles.len(), mesh.face_class.len());
        assert_eq!(mesh.positions.len(), mesh.colors.len());
        let corner = |i: u32| DVec3::from(mesh.positions[i as usize].map(f64::from));
        let triangles: Vec<[DVec3; 3]> = mesh.triangles.iter().map(|t| t.map(corner)).collect();
        let camera = s.info().camera;
        let (mut points, mut near, mut named) = (0, 0, 0);
        for i in [10, 95, 160] {
            let frame = s.frame(i).unwrap();
            let pose = frame.truth.unwrap();
            for k in (0..camera.pixels()).step_by(61) {
                let (u, v) = (k as u32 % camera.width, k as u32 / camera.width);
                let p = camera.back_project(f64::from(u), f64::from(v), depth_m(&frame, k));
                let p = pose.transform_point(p);
                let (mut best, mut class) = (f64::MAX, 0);
                for (t, &c) in triangles.iter().zip(&mesh.face_class) {
                    let reach = (p - t[0]).abs().max_element();
                    if reach < 0.15 {
                        let d = triangle_distance(p, *t);
                        if d < best {
                            (best, class) = (d, c);
                        }
                    }
                }
                points += 1;
                near += usize::from(best < 0.002);
                named += usize::from(class == frame.labels.as_ref().unwrap()[k]);
                assert!(best < 0.03, "{kind:?} frame {i} pixel {u} {v}: {best} m off the mesh");
            }
        }
        // Rims of cut faces and thin round things make up the rest.
        assert!(near * 100 >= points * 97, "{kind:?}: {near} of {points} within 2 mm");
        assert!(named * 100 >= points * 97, "{kind:?}: {named} of {points} with their class");
    }
}

#[test]
fn mesh_triangles_face_the_room() {
    let mesh = tiny(SceneKind::Room, 0, 1).ground_truth_mesh();
    let floor = 1;
    for (t, &class) in mesh.triangles.iter().zip(&mesh.face_class) {
        let [a, b, c] = t.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
        let n = (b - a).cross(c - a);
        assert!(n.length() > 0.0);
        if class == floor {
            assert!(n.z > 0.0, "the floor faces up");
        }
    }
}

#[test]
fn noise_is_that_of_a_depth_camera() {
    let options = SyntheticOptions { width: 160, height: 120, ..SyntheticOptions::default() };
    let mut clean = SyntheticSequence::new(options);
    let mut noisy = SyntheticSequence::new(SyntheticOptions { depth_noise: true, ..options });
    let (a, b) = (clean.frame(7).unwrap(), noisy.frame(7).unwrap());
    assert_eq!(a.color, b.color);
    assert!(a.depth.iter().all(|&d| d > 0), "exact depth is everywhere");
    let holes = b.depth.iter().filter(|&&d| d == 0).count();
    assert!(holes * 100 > b.depth.len() && holes * 5 < b.depth.len(), "{holes} holes");
    let median = |lo: f64, hi: f64| {
        let mut e: Vec<f64> = (0..a.depth.len())
            .filter(|&i| b.depth[i] > 0 && (lo..hi).contains(&depth_m(&a, i)))
            .map(|i| (depth_m(&a, i) - depth_m(&b, i)).abs())
            .collect();
        e.sort_by(f64::total_cmp);
        e[e.len() / 2]
    };
    let (near, far) = (median(0.8, 1.6), median(2.6, 3.6));
    assert!(near > 0.0003 && near < 0.006 && far > 2.0 * near && far < 0.03, "{near} {far}");
}

#[test]
fn odd_sizes_are_brought_into_range() {
    let options = SyntheticOptions { width: 0, height: 9, frames: 1, ..SyntheticOptions::tiny() };
    let mut s = SyntheticSequence::new(options);
    let frame = s.frame(0).unwrap();
    assert_eq!((s.options().width, s.options().height), (8, 9));
    assert_eq!(frame.color.len(), 72);
}
