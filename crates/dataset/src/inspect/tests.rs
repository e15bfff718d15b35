//! Recordings with each mistake made on purpose.
use super::*;
use glam::DQuat;
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    frame::{Frame, SequenceInfo},
    pose::Pose,
};

/// The built-in room with something done to it.
struct Spoiled {
    frames: Vec<Frame>,
    info: SequenceInfo,
}

impl Spoiled {
    fn new(frames: usize) -> Spoiled {
        let options = SyntheticOptions { frames, width: 96, height: 72, ..Default::default() };
        let mut room = SyntheticSequence::new(options);
        let info = room.info().clone();
        let frames = (0..frames).map(|i| room.frame(i).unwrap()).collect();
        Spoiled { frames, info }
    }

    fn poses(mut self, change: impl Fn(Pose) -> Pose) -> Spoiled {
        self.frames.iter_mut().for_each(|f| f.truth = f.truth.map(&change));
        self
    }

    fn inspect(mut self) -> Inspection {
        inspect(&mut self, InspectOptions::default(), |_, _| {}).unwrap()
    }

    /// Returns the one warning.
    fn warning(self) -> String {
        let found = self.inspect();
        let warnings: Vec<&Remark> =
            found.remarks.iter().filter(|r| r.severity == Severity::Warning).collect();
        assert_eq!(warnings.len(), 1, "{found:#?}");
        warnings[0].text.clone()
    }
}

impl Sequence for Spoiled {
    fn info(&self) -> &SequenceInfo {
        &self.info
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        Ok(self.frames[index].clone())
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        self.frames[index].truth
    }

    fn time_s(&self, index: usize) -> f64 {
        self.frames[index].time_s
    }
}

#[test]
fn a_good_recording_has_nothing_to_remark() {
    let found = Spoiled::new(40).inspect();
    assert!(found.remarks.is_empty(), "{:#?}", found.remarks);
    let agreement = found.agreement.unwrap();
    assert!(agreement.error < 0.01 && agreement.error_without_motion > 0.02, "{agreement:?}");
    assert!((agreement.best_factor - 1.0).abs() < 0.03, "{agreement:?}");
    assert_eq!((found.poses.known, found.frames), (40, 40));
    let labels = found.labels.unwrap();
    assert!(labels.present.len() > 5 && labels.present[0].share > 0.1);
    let total: f64 = labels.present.iter().map(|c| c.share).sum();
    assert!((total - 1.0).abs() < 1e-9);
    assert!((0.5..4.0).contains(&found.depth.median_m) && found.depth.holes < 0.2);
}

#[test]
fn a_wrong_unit_of_depth_is_found_by_the_poses() {
    // The numbers are in the first unit and read as if they were in the second.
    for (meant, read) in [
        (5000.0, 1000.0),
        (1000.0, 5000.0),
        (6553.5, 5000.0),
        (5000.0, 6553.5),
        (1000.0, 6553.5),
        (6553.5, 1000.0),
    ] {
        let mut room = Spoiled::new(40);
        let ratio = meant * room.info.depth_unit_m;
        for d in room.frames.iter_mut().flat_map(|f| &mut f.depth) {
            *d = (f64::from(*d) * ratio).round() as u16;
        }
        room.info.depth_unit_m = 1.0 / read;
        let text = room.warning();
        assert!(text.contains(&format!("with {meant} units")), "{meant} {read}: {text}");
        assert!(text.contains(&format!("--depth-scale {meant}")), "{meant} {read}: {text}");
    }
}

#[test]
fn other_axes_and_other_meanings_of_the_poses_are_found() {
    let scalar_first = |p: Pose| {
        let q = p.quaternion();
        Pose::from_quaternion(p.translation, DQuat::from_xyzw(q.w, q.x, q.y, q.z))
    };
    let text = Spoiled::new(40).poses(|p| p.with_flipped_camera()).warning();
    assert!(text.contains("OpenGL") && text.contains("--axes opengl"), "{text}");
    let text = Spoiled::new(40).poses(|p| p.inverse()).warning();
    assert!(text.contains("camera_from_world") && !text.contains("OpenGL"), "{text}");
    let text = Spoiled::new(40).poses(|p| p.with_flipped_camera().inverse()).warning();
    assert!(text.contains("camera_from_world") && text.contains("OpenGL"), "{text}");
    let text = Spoiled::new(40).poses(scalar_first).warning();
    assert!(text.contains("scalar first"), "{text}");
}

#[test]
fn poses_in_lexical_order_are_found() {
    let mut room = Spoiled::new(40);
    let mut names: Vec<usize> = (0..40).collect();
    names.sort_by_key(|i| i.to_string());
    let truths: Vec<_> = names.iter().map(|&i| room.frames[i].truth).collect();
    for (frame, truth) in room.frames.iter_mut().zip(truths) {
        frame.truth = truth;
    }
    let found = room.inspect();
    assert!(found.remarks[0].text.contains("lexical order"), "{:#?}", found.remarks);
}

#[test]
fn a_scale_that_is_nobodys_and_poses_of_something_else_are_said() {
    let scaled = |p: Pose| Pose { translation: p.translation * 2.5, ..p };
    let text = Spoiled::new(40).poses(scaled).warning();
    assert!(text.contains("different scales"), "{text}");
    let mut room = Spoiled::new(40);
    let truths: Vec<_> = room.frames.iter().rev().map(|f| f.truth).collect();
    for (i, frame) in room.frames.iter_mut().enumerate() {
        frame.truth = truths[(i * 17) % 40];
    }
    let found = room.inspect();
    assert!(found.has_warnings(), "{:#?}", found.remarks);
    assert!(found.remarks.iter().any(|r| r.text.contains("none of the usual")), "{found:#?}");
}

#[test]
fn without_poses_only_the_range_speaks() {
    let mut room = Spoiled::new(5);
    room.frames.iter_mut().for_each(|f| f.truth = None);
    room.info.depth_unit_m = 1.0 / 256.0;
    let text = room.warning();
    assert!(text.contains("which no room has") && text.contains("--depth-scale 6553.5"), "{text}");
    let mut room = Spoiled::new(8);
    room.frames[2].truth = None;
    room.frames[3].truth = None;
    room.frames[5].depth.fill(0);
    for d in room.frames.iter_mut().flat_map(|f| f.depth.iter_mut().step_by(9)) {
        *d = 65535;
    }
    let found = room.inspect();
    assert_eq!(found.poses.gaps, [Gap { first: 2, last: 3 }]);
    let all: String = found.remarks.iter().map(|r| format!("{}\n", r.text)).collect();
    for part in ["frames 2-3", "65535"] {
        assert!(all.contains(part), "{all}");
    }
}

#[test]
fn a_camera_of_larger_images_is_found() {
    let mut room = Spoiled::new(20);
    let c = &mut room.info.camera;
    (c.fx, c.fy) = (2.0 * c.fx, 2.0 * c.fy);
    (c.cx, c.cy) = (2.0 * c.cx + 0.5, 2.0 * c.cy + 0.5);
    let found = room.inspect();
    let text: String = found.remarks.iter().map(|r| r.text.as_str()).collect();
    assert!(found.has_warnings() && text.contains("about 192x144"), "{:#?}", found.remarks);
}

#[test]
fn depth_that_is_far_too_near_is_a_warning() {
    let mut room = Spoiled::new(5);
    room.frames.iter_mut().for_each(|f| f.truth = None);
    // Millimetres of a smaller room, read as TUM's unit.
    let ratio = 600.0 * room.info.depth_unit_m;
    for d in room.frames.iter_mut().flat_map(|f| &mut f.depth) {
        *d = (f64::from(*d) * ratio).round() as u16;
    }
    room.info.depth_unit_m = 1.0 / 5000.0;
    let text = room.warning();
    assert!(
        text.contains("nearer than rooms are") && text.contains("--depth-scale 1000"),
        "{text}"
    );
}

#[test]
fn a_limit_is_proposed_where_some_depth_is_far_from_the_rest() {
    let mut room = Spoiled::new(10);
    let units = 1.0 / room.info.depth_unit_m;
    // One pixel in 25 at 20 to 60 m, in millimetres, as that is.
    for frame in &mut room.frames {
        for d in &mut frame.depth {
            *d = (f64::from(*d) / units * 1000.0) as u16;
        }
        let noisy = frame.depth.iter_mut().step_by(25).enumerate();
        noisy.for_each(|(i, d)| *d = 20_000 + (i * 37 % 400) as u16 * 100);
    }
    room.info.depth_unit_m = 1e-3;
    let found = room.inspect();
    let far = found.depth.far.unwrap();
    assert!((0.03..0.06).contains(&far.share) && (4.0..20.0).contains(&far.limit_m), "{far:?}");
    let said: String = found.remarks.iter().map(|r| r.text.as_str()).collect();
    assert!(said.contains(&format!("--max-depth {}", far.limit_m)), "{said}");
}
