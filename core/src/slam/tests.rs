//! The loop as a whole, on small frames of the built-in room.
use super::*;
use crate::{
    camera::Camera,
    config::Config,
    engine::Engine,
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};
use alloc::{vec, vec::Vec};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use pollster::block_on;

/// Focal length of the colour camera over that of the depth camera.
const SCALE: f64 = 0.9;

/// The room through a depth camera whose colour camera has another focal length.
struct Unregistered {
    /// As the colour camera sees it.
    color: SyntheticSequence,
    /// Four times as large, to take the depth camera's pixels from.
    fine: SyntheticSequence,
    info: SequenceInfo,
}

impl Unregistered {
    fn new() -> Unregistered {
        let options = SyntheticOptions { width: 128, height: 96, ..SyntheticOptions::default() };
        let color = SyntheticSequence::new(options);
        let (width, height) = (4 * options.width, 4 * options.height);
        let fine = SyntheticSequence::new(SyntheticOptions { width, height, ..options });
        let mut info = color.info().clone();
        info.camera.fx /= SCALE;
        info.camera.fy /= SCALE;
        Unregistered { color, fine, info }
    }

    /// A frame with colour as recorded, and the colour that belongs to its depth pixels.
    fn frame(&mut self, index: usize, at: usize) -> (Frame, Vec<[u8; 3]>) {
        let recorded = self.color.frame(at).unwrap();
        let fine = self.fine.frame(at).unwrap();
        let (depth_camera, camera) = (self.info.camera, self.fine.info().camera);
        let mut frame = Frame { index, labels: Some(Vec::new()), depth: Vec::new(), ..recorded };
        let mut registered = Vec::new();
        for v in 0..depth_camera.height {
            for u in 0..depth_camera.width {
                let p = depth_camera.back_project(u.into(), v.into(), 1.0);
                let at = camera.project(p).unwrap();
                let i = at.y.round() as usize * camera.width as usize + at.x.round() as usize;
                frame.depth.push(fine.depth[i]);
                // A pixel of the depth camera is 3.6 of these wide.
                let mean = |k: usize| {
                    let rows = [-1, 0, 1].map(|dv| i as isize + dv * camera.width as isize);
                    let all = rows.iter().flat_map(|r| [r - 1, *r, r + 1]);
                    let last = fine.color.len() as isize - 1;
                    let sum: u32 =
                        all.map(|j| u32::from(fine.color[j.clamp(0, last) as usize][k])).sum();
                    (sum / 9) as u8
                };
                registered.push([mean(0), mean(1), mean(2)]);
            }
        }
        frame.labels = None;
        (frame, registered)
    }
}

fn psnr_db(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    mte_slam_metrics::PsnrMeter::default().add(a, b).unwrap()
}

fn stored_color(slam: &mut Slam, slot: u32) -> Vec<[u8; 4]> {
    let (engine, map, _) = slam.mapped().unwrap();
    block_on(map.frames.read_color(engine, slot)).unwrap()
}

#[test]
fn the_map_gets_its_colours_where_the_odometer_found_them() {
    let mut room = Unregistered::new();
    let camera: Camera = room.info.camera;
    let mut config = Config::preset("fast").unwrap();
    (config.mapping.rays, config.mapping.first_iterations) = (1000, 60);
    room.info.classes = Default::default();
    let mut slam = block_on(Slam::new(Engine::cpu(), config, &room.info)).unwrap();
    let mut frames = vec![];
    for index in 0..12 {
        let (frame, registered) = room.frame(index, 5 * index);
        block_on(slam.process(&frame)).unwrap();
        frames.push((frame, registered));
    }
    block_on(slam.finish()).unwrap();
    let found = slam.color_registration().scale;
    assert!((found - SCALE).abs() < 0.02, "{found}");
    // The first frame was stored long before anything was known.
    let first = slam.keyframes[0].clone();
    assert_eq!(first.frame, 0);
    let stored = stored_color(&mut slam, first.slot);
    let stored: Vec<[u8; 3]> = stored.iter().map(|p| [p[0], p[1], p[2]]).collect();
    let (before, after) =
        (psnr_db(&frames[0].0.color, &frames[0].1), psnr_db(&stored, &frames[0].1));
    let (mut as_recorded, mut as_trained, mut compared) = (0.0, 0.0, f64::MAX);
    for (estimate, (frame, registered)) in slam.trajectory().iter().zip(&frames).step_by(4) {
        let view = block_on(slam.render(&estimate.world_from_camera, &camera)).unwrap();
        as_recorded += psnr_db(&view.color, &frame.color) / 3.0;
        as_trained += psnr_db(&view.color, registered) / 3.0;
        // What the metrics compare with is that, too.
        compared = compared.min(psnr_db(&slam.registered(frame).color, registered));
    }
    println!(
        "stored {before:.1} -> {after:.1} dB, rendered {as_recorded:.1} -> {as_trained:.1}, compared with {compared:.1}"
    );
    assert!(after > before + 5.0 && compared > before + 5.0);
    assert!(as_trained > as_recorded + 3.0);
}

#[test]
fn a_run_goes_on_from_its_checkpoint_with_the_colours_it_had_found() {
    let mut room = Unregistered::new();
    let mut config = Config::preset("fast").unwrap();
    config.mapping.rays = 200;
    (config.mapping.first_iterations, config.mapping.iterations) = (20, 2);
    (config.mapping.final_iterations, config.field.use_given_bounds) = (2, false);
    room.info.classes = Default::default();
    let frames: Vec<Frame> = (0..12).map(|i| room.frame(i, 5 * i).0).collect();
    let mut slam = block_on(Slam::new(Engine::cpu(), config.clone(), &room.info)).unwrap();
    // Before a registration is known, right after it, and at the end.
    let mut saved = Vec::new();
    for frame in &frames {
        let before = slam.registrations.len();
        block_on(slam.process(frame)).unwrap();
        if frame.index == 1 || slam.registrations.len() > before || frame.index == 10 {
            saved.push(block_on(slam.checkpoint()).unwrap());
        }
    }
    assert!(!slam.registrations.is_empty() && saved.len() >= 3, "{:?}", slam.registrations);
    block_on(slam.finish()).unwrap();
    let end = block_on(slam.checkpoint()).unwrap();
    for checkpoint in saved {
        let resumed = Slam::resume(Engine::cpu(), config.clone(), &room.info, &checkpoint);
        let mut resuming = block_on(resumed).unwrap();
        for index in resuming.missing().collect::<Vec<usize>>() {
            resuming.add(&frames[index]).unwrap();
        }
        let mut again = resuming.finish().unwrap();
        for frame in &frames[again.next_frame()..] {
            block_on(again.process(frame)).unwrap();
        }
        block_on(again.finish()).unwrap();
        for k in &again.keyframes.clone() {
            let stored = stored_color(&mut slam, k.slot);
            assert!(stored == stored_color(&mut again, k.slot), "frame {}", k.frame);
        }
        assert!(block_on(again.checkpoint()).unwrap() == end);
    }
}

/// Share of the pixels that a map says are of the rarer class, from one frame with three tenths of
/// its labels so, anywhere, and weights that make five of two.
fn share_of_rarer(adjustment: f64) -> f64 {
    let options = SyntheticOptions { width: 64, height: 48, ..SyntheticOptions::default() };
    let mut room = SyntheticSequence::new(options);
    let info = room.info().clone();
    let mut frame = room.frame(0).unwrap();
    let labels = (0..frame.depth.len() as u32)
        .map(|i| u8::from(crate::kernels::shared::random_f32(7, 0, i, 0) < 0.3))
        .collect();
    frame.labels = Some(labels);
    let mut config = Config::preset("fast").unwrap();
    (config.loss.balance, config.loss.adjustment) = (2.0, adjustment);
    (config.sampling.rare_share, config.sampling.semantic_rare_share) = (0.0, 0.0);
    (config.suppressor.enabled, config.fusion.enabled) = (false, false);
    // Too coarse to know each pixel's label by heart.
    (config.field.surface_coarse_m, config.field.surface_fine_m) = (0.96, 0.48);
    (config.mapping.rays, config.mapping.first_iterations) = (1000, 60);
    (config.mapping.final_iterations, config.mapping.semantic_iterations) = (10, 60);
    let mut slam = block_on(Slam::new(Engine::cpu(), config, &info)).unwrap();
    block_on(slam.process(&frame)).unwrap();
    block_on(slam.finish()).unwrap();
    let pose = slam.trajectory()[0].world_from_camera;
    let view = block_on(slam.render(&pose, &info.camera)).unwrap();
    let rarer = view.class.iter().filter(|c| **c == 1).count();
    rarer as f64 / view.class.len() as f64
}

#[test]
fn a_rare_class_weighs_more_without_being_taken_for_more() {
    let (weighed_up, adjusted) = (share_of_rarer(0.0), share_of_rarer(1.0));
    assert!(weighed_up > 0.9 && adjusted < 0.1, "{weighed_up} {adjusted}");
}
