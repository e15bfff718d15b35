//! Tests on rendered scenes with known motion.
use super::{pyramid::Level, *};
use alloc::{vec, vec::Vec};
use glam::DVec3;
use mte_slam_types::{camera::Camera, frame::Frame, pose::Pose};

fn camera() -> Camera {
    Camera { width: 160, height: 120, fx: 130.0, fy: 132.0, cx: 79.5, cy: 59.5 }
}

/// Smooth texture in world coordinates, 0..1.
fn texture(p: DVec3) -> f32 {
    let s = 0.5
        + 0.13 * (7.0 * p.x + 1.3).sin() * (6.0 * p.y).cos()
        + 0.12 * (11.0 * p.y + 5.0 * p.z).sin()
        + 0.1 * (9.0 * p.z - 8.0 * p.x).cos();
    s as f32
}

/// Nearest hit of a ray with planes n . p = d.
fn render(planes: &[(DVec3, f64)], pose: &Pose, textured: bool) -> RgbdPyramid {
    render_unregistered(planes, pose, textured, 1.0)
}

/// The same, with a colour camera whose focal length is `scale` times the depth camera's.
fn render_unregistered(
    planes: &[(DVec3, f64)],
    pose: &Pose,
    textured: bool,
    scale: f64,
) -> RgbdPyramid {
    let c = camera();
    let cast = |ray: DVec3| {
        let (o, r) = (pose.translation, pose.transform_vector(ray));
        let z = planes
            .iter()
            .map(|(n, d)| (d - n.dot(o)) / n.dot(r))
            .filter(|z| *z > 0.1)
            .fold(f64::INFINITY, f64::min);
        (z < 7.0).then(|| (z as f32, texture(o + r * z)))
    };
    let (mut intensity, mut depth) = (Vec::new(), Vec::new());
    for v in 0..c.height {
        for u in 0..c.width {
            let ray = c.back_project(f64::from(u), f64::from(v), 1.0);
            depth.push(cast(ray).map_or(0.0, |hit| hit.0));
            let colour = cast(DVec3::new(ray.x / scale, ray.y / scale, 1.0));
            intensity.push(colour.filter(|_| textured).map_or(0.5, |hit| hit.1));
        }
    }
    RgbdPyramid::from_images(0, intensity, depth, &c, &PyramidConfig::default())
}

fn room() -> Vec<(DVec3, f64)> {
    vec![
        (DVec3::new(0.0, 0.0, 1.0), 2.5),
        (DVec3::new(1.0, 0.0, 0.2).normalize(), 1.4),
        (DVec3::new(0.1, 1.0, 0.0).normalize(), 1.0),
    ]
}

fn wall() -> Vec<(DVec3, f64)> {
    vec![(DVec3::new(0.1, 0.05, 1.0).normalize(), 2.0)]
}

fn motion() -> Pose {
    Pose::from_twist(&[0.03, -0.02, 0.04, 0.02, -0.03, 0.015])
}

fn difference(a: &Pose, b: &Pose) -> f64 {
    let d = a.inverse().compose(b);
    d.translation.length() + d.angle_rad()
}

#[test]
fn known_motion_is_recovered() {
    for planes in [room(), wall()] {
        let reference = render(&planes, &Pose::IDENTITY, true);
        let current = render(&planes, &motion(), true);
        let fit = align(&reference, &current, &Pose::IDENTITY, &AlignConfig::default()).unwrap();
        assert!(difference(&fit.pose, &motion()) < 1e-3, "{:?}", fit.pose);
        assert_eq!(fit.unconstrained, 0);
        assert!(fit.inlier_ratio > 0.8 && fit.geometric_rmse_m < 1e-3);
    }
}

#[test]
fn exposure_change_does_not_move_the_pose() {
    let c = camera();
    let reference = render(&wall(), &Pose::IDENTITY, true);
    let other = render(&wall(), &motion(), true);
    let level: &Level = &other.levels[0];
    let intensity = level.texels.iter().map(|t| 0.8 * t[0] + 0.05).collect();
    let depth = level.texels.iter().map(|t| t[3]).collect();
    let current = RgbdPyramid::from_images(1, intensity, depth, &c, &PyramidConfig::default());
    let fit = align(&reference, &current, &Pose::IDENTITY, &AlignConfig::default()).unwrap();
    assert!(difference(&fit.pose, &motion()) < 1.5e-3, "{:?}", fit.pose);
}

#[test]
fn identical_frames_give_identity() {
    let frame = render(&room(), &Pose::IDENTITY, true);
    let fit = align(&frame, &frame, &Pose::IDENTITY, &AlignConfig::default()).unwrap();
    assert!(difference(&fit.pose, &Pose::IDENTITY) < 1e-5);
    assert!(fit.converged && fit.inlier_ratio > 0.9);
}

#[test]
fn several_references_agree_with_one() {
    let away = Pose::from_twist(&[-0.05, 0.02, 0.0, 0.0, 0.04, 0.0]);
    let (a, b) = (render(&room(), &Pose::IDENTITY, true), render(&room(), &away, true));
    let current = render(&room(), &motion(), true);
    let references = [
        Reference { pyramid: &a, world_from_camera: Pose::IDENTITY, weight: 1.0 },
        Reference { pyramid: &b, world_from_camera: away, weight: 1.0 },
    ];
    let fit = align_many(&references, &current, &Pose::IDENTITY, &AlignConfig::default()).unwrap();
    assert!(difference(&fit.pose, &motion()) < 1e-3, "{:?}", fit.pose);
    assert_eq!(fit.overlaps.len(), 2);
}

#[test]
fn a_blank_wall_leaves_three_directions_alone() {
    // Sliding along the wall and turning about its normal cannot be seen.
    let reference = render(&wall(), &Pose::IDENTITY, false);
    let towards = DVec3::new(0.1, 0.05, 1.0).normalize() * 0.03;
    let moved = Pose { translation: towards + DVec3::new(0.05, 0.0, -0.005), ..Pose::IDENTITY };
    let current = render(&wall(), &moved, false);
    let config = AlignConfig { degenerate_ratio: 1e-4, ..AlignConfig::default() };
    let fit = align(&reference, &current, &Pose::IDENTITY, &config).unwrap();
    assert_eq!(fit.unconstrained, 3, "{:?}", fit.eigenvalues);
    assert!(fit.conditioning() < 1e-4);
    let n = DVec3::new(0.1, 0.05, 1.0).normalize();
    let error = fit.pose.translation - moved.translation;
    assert!(error.dot(n).abs() < 1e-3, "{error}");
    assert!((fit.pose.translation - n * fit.pose.translation.dot(n)).length() < 1e-3);
}

#[test]
fn no_depth_is_a_typed_failure() {
    let c = camera();
    let empty = Frame {
        features: None,
        index: 3,
        number: 3,
        time_s: 0.0,
        color: vec![[128; 3]; c.pixels()],
        depth: vec![0; c.pixels()],
        labels: None,
        truth: None,
    };
    let config = OdometryConfig::default();
    let blind = RgbdPyramid::new(&empty, &c, 1e-3, &config.pyramid).unwrap();
    let seeing = render(&room(), &Pose::IDENTITY, true);
    for (a, b) in [(&blind, &seeing), (&seeing, &blind)] {
        let e = align(a, b, &Pose::IDENTITY, &config.align).unwrap_err();
        assert_eq!(e, OdometryError::NoDepth { frame: 3, found: 0, expected: 300 });
    }
    let short = Frame { depth: vec![1; 5], ..empty };
    let e = RgbdPyramid::new(&short, &c, 1e-3, &config.pyramid).unwrap_err();
    assert!(matches!(e, OdometryError::ImageSize { image: "depth", found: 5, .. }));
    let nan = Pose { translation: DVec3::NAN, ..Pose::IDENTITY };
    assert!(matches!(
        align(&seeing, &seeing, &nan, &config.align),
        Err(OdometryError::BadPose { .. })
    ));
    let mut odometer = Odometer::new(config);
    assert!(odometer.track(blind.clone(), None).is_err());
    odometer.track(seeing.clone(), Some(Pose::IDENTITY)).unwrap();
    let lost = odometer.track(blind, None).unwrap();
    assert!(lost.lost && lost.reason == Some(LostReason::NoDepth));
    assert!(lost.world_from_camera.is_finite() && odometer.keyframes().len() == 1);
    let back = odometer.track(seeing, None).unwrap();
    assert!(!back.lost && difference(&back.world_from_camera, &Pose::IDENTITY) < 1e-4);
}

#[test]
fn a_view_of_something_else_is_lost_and_adds_no_keyframe() {
    let mut odometer = Odometer::new(OdometryConfig::default());
    odometer.track(render(&room(), &Pose::IDENTITY, true), Some(Pose::IDENTITY)).unwrap();
    let c = camera();
    let mut noise = 1u32;
    let mut random = || {
        noise = noise.wrapping_mul(747796405).wrapping_add(2891336453);
        (noise >> 8) as f32 / (1u32 << 24) as f32
    };
    let intensity = (0..c.pixels()).map(|_| random()).collect();
    let depth = (0..c.pixels()).map(|_| 1.0 + 4.0 * random()).collect();
    let junk = RgbdPyramid::from_images(1, intensity, depth, &c, &PyramidConfig::default());
    let result = odometer.track(junk, None).unwrap();
    assert!(result.lost, "{:?}", result.quality);
    assert_eq!(odometer.keyframes().len(), 1);
}

#[test]
fn a_walk_stays_on_course_and_follows_corrections() {
    for pose_graph in [false, true] {
        walk(OdometryConfig { pose_graph, ..OdometryConfig::default() });
    }
}

fn walk(config: OdometryConfig) {
    let mut odometer = Odometer::new(config);
    let mut truth = Pose::IDENTITY;
    let step = Pose::from_twist(&[0.02, 0.005, 0.015, 0.004, -0.01, 0.006]);
    for i in 0..12 {
        let mut pyramid = render(&room(), &truth, true);
        pyramid.frame = i;
        let result = odometer.track(pyramid, (i == 0).then_some(truth)).unwrap();
        assert!(!result.lost, "{i}");
        assert!(difference(&result.world_from_camera, &truth) < 3e-3, "{i}");
        truth = truth.compose(&step);
    }
    assert!(odometer.keyframes().len() > 1);
    let before = odometer.trajectory();
    let id = odometer.keyframes()[0].id;
    let shift = Pose { translation: DVec3::new(1.0, 0.0, 0.0), ..Pose::IDENTITY };
    assert!(odometer.set_keyframe_pose(id, shift));
    let after = odometer.trajectory();
    assert!((after[0].1.translation.x - before[0].1.translation.x - 1.0).abs() < 1e-9);
    assert!(!odometer.set_keyframe_pose(999, shift));
}

#[cfg(feature = "threads")]
#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let run = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let reference = render(&room(), &Pose::IDENTITY, true);
            let current = render(&room(), &motion(), true);
            let config = AlignConfig { max_points: 100_000, ..AlignConfig::default() };
            let fit = align(&reference, &current, &Pose::IDENTITY, &config).unwrap();
            (fit.pose, fit.information)
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn a_loop_closure_straightens_a_bent_chain() {
    let step = Pose::from_twist(&[0.3, 0.0, 0.1, 0.0, 0.3, 0.05]);
    let bent = Pose::from_twist(&[0.01, -0.01, 0.02, 0.01, 0.02, -0.01]).compose(&step);
    let mut truth = vec![Pose::IDENTITY];
    let mut graph = PoseGraph { poses: vec![Pose::IDENTITY], edges: Vec::new() };
    let mut information = [[0.0; 6]; 6];
    (0..6).for_each(|i| information[i][i] = 1e4);
    for i in 0..8 {
        truth.push(truth[i].compose(&step));
        graph.poses.push(graph.poses[i].compose(&bent));
    }
    for i in 0..9 {
        for j in [i + 1, i + 3] {
            if j < 9 {
                let i_from_j = truth[i].inverse().compose(&truth[j]);
                graph.edges.push(Edge { i, j, i_from_j, information });
            }
        }
    }
    let (before, after) = graph.optimise(1, 15, 1e3);
    assert!(after < 1e-9 * before, "{before} {after}");
    for (a, b) in graph.poses.iter().zip(&truth) {
        assert!(difference(a, b) < 1e-6);
    }
}

#[test]
fn a_colour_camera_of_another_focal_length_is_found_and_an_equal_one_left_alone() {
    let poses = [
        Pose::IDENTITY,
        Pose::from_twist(&[0.12, -0.05, 0.1, 0.05, -0.12, 0.06]),
        Pose::from_twist(&[-0.1, 0.08, -0.05, -0.08, 0.1, -0.05]),
    ];
    for scale in [0.9, 1.0] {
        let views: Vec<_> =
            poses.iter().map(|p| render_unregistered(&room(), p, true, scale)).collect();
        let pairs: Vec<_> = [(0, 1), (1, 2), (0, 2)]
            .map(|(i, j)| registration_search::Pair {
                reference: &views[i],
                current: &views[j],
                reference_from_current: poses[i].inverse().compose(&poses[j]),
            })
            .into();
        let found = registration_search::estimate(&pairs).scale;
        assert!((found - scale).abs() < 0.01, "found {found}, expected {scale}");
    }
}
