//! Whether classes stay with the surfaces they are on, from one view to the next: a figure that needs no
//! true labels.
use crate::protocol;
use alloc::{string::String, vec::Vec};
use mte_slam_types::{camera::Camera, classes::UNLABELLED, pose::Pose};
use serde::Serialize;

/// Depths that differ by more than this share are of different surfaces.
const SAME_SURFACE: f32 = 0.03;

/// How often a surface point has another class in the next view.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConsistencyReport {
    /// Id of the protocol.
    pub protocol_id: String,
    /// What was compared.
    pub protocol: String,
    /// Pairs of views.
    pub pairs: usize,
    /// Pixels compared.
    pub pixels: u64,
    /// Share of them whose class differs \[%\].
    pub changed_percent: f64,
}

struct Seen {
    depth_m: Vec<f32>,
    world_from_camera: Pose,
    classes: Vec<u8>,
}

/// Collects views in order.
pub struct ConsistencyMeter {
    camera: Camera,
    last: Option<Seen>,
    pairs: usize,
    pixels: u64,
    changed: u64,
}

impl ConsistencyMeter {
    /// No views yet.
    pub fn new(camera: Camera) -> ConsistencyMeter {
        ConsistencyMeter { camera, last: None, pairs: 0, pixels: 0, changed: 0 }
    }

    /// Adds a view: measured depth \[m\], 0 where there is none, pose, and classes. Images of another size than
    /// the camera's are left out.
    pub fn add(&mut self, depth_m: &[f32], world_from_camera: &Pose, classes: &[u8]) {
        let pixels = self.camera.pixels();
        if depth_m.len() != pixels || classes.len() != pixels {
            return;
        }
        if let Some(last) = &self.last {
            let (n, changed) = self.compare(last, depth_m, world_from_camera, classes);
            self.pairs += 1;
            self.pixels += n;
            self.changed += changed;
        }
        self.last = Some(Seen {
            depth_m: depth_m.to_vec(),
            world_from_camera: *world_from_camera,
            classes: classes.to_vec(),
        });
    }

    /// Pixels of `last` that lie on the same surface and have a class in both, and those of them
    /// whose class differs.
    fn compare(&self, last: &Seen, depth_m: &[f32], pose: &Pose, classes: &[u8]) -> (u64, u64) {
        let camera = &self.camera;
        let (w, h) = (camera.width as usize, camera.height as usize);
        let camera_from_last = pose.inverse().compose(&last.world_from_camera);
        let (mut n, mut changed) = (0, 0);
        for (i, (&z, &class)) in last.depth_m.iter().zip(&last.classes).enumerate() {
            if z <= 0.0 || !z.is_finite() || class == UNLABELLED {
                continue;
            }
            let point = camera.back_project((i % w) as f64, (i / w) as f64, f64::from(z));
            let point = camera_from_last.transform_point(point);
            let Some(at) = camera.project(point) else { continue };
            let (x, y) = (at.x + 0.5, at.y + 0.5);
            if x < 0.0 || y < 0.0 || x >= w as f64 || y >= h as f64 {
                continue;
            }
            let at = y as usize * w + x as usize;
            let measured = depth_m[at];
            let same = (measured - point.z as f32).abs() <= SAME_SURFACE * measured;
            if measured > 0.0 && same && classes[at] != UNLABELLED {
                n += 1;
                changed += u64::from(classes[at] != class);
            }
        }
        (n, changed)
    }

    /// The figure; `None` without a pixel to compare.
    pub fn report(&self) -> Option<ConsistencyReport> {
        (self.pixels > 0).then(|| ConsistencyReport {
            protocol_id: protocol::CONSISTENCY.into(),
            protocol: "share of the surface points seen in a view and in the next one (measured depth within \
                       3 %, estimated poses) whose class differs between the two; no true labels take part"
                .into(),
            pairs: self.pairs,
            pixels: self.pixels,
            changed_percent: 100.0 * self.changed as f64 / self.pixels as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    fn camera() -> Camera {
        Camera { width: 40, height: 30, fx: 40.0, fy: 40.0, cx: 19.5, cy: 14.5 }
    }

    fn pose(x: f64) -> Pose {
        Pose { rotation: DMat3::IDENTITY, translation: DVec3::new(x, 0.0, 0.0) }
    }

    /// A wall 2 m away whose left half, in the world, is of another class.
    fn wall(x: f64) -> (Vec<f32>, Vec<u8>) {
        let class = |i: usize| {
            let at = ((i % 40) as f64 - 19.5) / 40.0 * 2.0 + x;
            u8::from(at > 0.024)
        };
        (alloc::vec![2.0; 1200], (0..1200).map(class).collect())
    }

    #[test]
    fn classes_that_stay_on_their_surfaces_do_not_change() {
        let mut meter = ConsistencyMeter::new(camera());
        assert!(meter.report().is_none());
        // A pixel is 5 cm wide there.
        for x in [0.0, 0.1, 0.3] {
            let (depth, classes) = wall(x);
            meter.add(&depth, &pose(x), &classes);
        }
        let report = meter.report().unwrap();
        assert_eq!((report.pairs, report.changed_percent), (2, 0.0));
        assert_eq!(report.pixels, (38 + 36) * 30);
        // The same pictures from a camera that did not move: what moved is the class.
        let mut meter = ConsistencyMeter::new(camera());
        for x in [0.0, 0.1] {
            let (depth, classes) = wall(x);
            meter.add(&depth, &pose(0.0), &classes);
        }
        assert_eq!(meter.report().unwrap().changed_percent, 100.0 * 2.0 / 40.0);
    }

    #[test]
    fn other_surfaces_holes_and_pixels_without_a_class_do_not_count() {
        let (depth, classes) = wall(0.0);
        let changed: Vec<u8> = classes.iter().map(|c| 1 - c).collect();
        let count = |depth: &[f32], classes: &[u8]| {
            let mut meter = ConsistencyMeter::new(camera());
            meter.add(&wall(0.0).0, &pose(0.0), &wall(0.0).1);
            meter.add(depth, &pose(0.0), classes);
            meter.report().map(|r| (r.pixels, r.changed_percent))
        };
        assert_eq!(count(&depth, &changed), Some((1200, 100.0)));
        assert_eq!(count(&[1.5; 1200], &changed), None);
        assert_eq!(count(&[0.0; 1200], &changed), None);
        assert_eq!(count(&depth, &[UNLABELLED; 1200]), None);
        assert_eq!(count(&depth[1..], &changed), None);
    }
}
