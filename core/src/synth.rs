//! Stand-in for the built-in sequence: a box with checkers.
#![allow(missing_docs)]
use crate::{
    camera::Camera,
    classes::{Class, ClassTable},
    frame::{Frame, SequenceInfo},
    pose::Pose,
    sequence::{Sequence, SequenceError},
};
use alloc::vec::Vec;

pub struct SyntheticSequence {
    info: SequenceInfo,
}

impl SyntheticSequence {
    pub fn new(frames: usize, width: u32) -> Self {
        let height = width * 3 / 4;
        let f = f64::from(width) * 0.65;
        let camera = Camera {
            width,
            height,
            fx: f,
            fy: f,
            cx: f64::from(width) / 2.0 - 0.5,
            cy: f64::from(height) / 2.0 - 0.5,
        };
        let class = |raw_id, name: &str, color| Class { raw_id, name: name.into(), color };
        let classes = ClassTable {
            classes: [
                class(3, "wall", [120, 160, 220]),
                class(5, "ceiling", [220, 200, 120]),
                class(9, "floor", [140, 90, 60]),
            ]
            .into(),
        };
        let info = SequenceInfo {
            name: "built-in room".into(),
            layout: "synthetic",
            camera,
            depth_unit_m: 1.0 / 6553.5,
            frames,
            classes,
            bounds: None,
        };
        SyntheticSequence { info }
    }
}

impl Sequence for SyntheticSequence {
    fn info(&self) -> &SequenceInfo {
        &self.info
    }

    fn frame(&mut self, index: usize) -> Result<Frame, SequenceError> {
        let pose = self.truth(index).unwrap_or_default();
        let c = self.info.camera;
        let (mut color, mut depth, mut labels) = (Vec::new(), Vec::new(), Vec::new());
        for v in 0..c.height {
            for u in 0..c.width {
                let d = pose.transform_vector(c.back_project(f64::from(u), f64::from(v), 1.0));
                let o = pose.translation;
                let (t, axis) = (0..3)
                    .map(|k| {
                        let wall = if d[k] > 0.0 { 1.5 } else { -1.5 };
                        ((wall - o[k]) / d[k], k)
                    })
                    .filter(|(t, _)| t.is_finite())
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .unwrap_or((1.0, 0));
                let p = o + d * t;
                let dark = (0..3).map(|k| (p[k] * 3.0 + 0.1).floor() as i64).sum::<i64>() & 1 == 1;
                let s = if dark { 90 } else { 190 };
                color.push([s, s - 20 * axis as u8, s - 40]);
                depth.push((t * 6553.5) as u16);
                labels.push(if axis != 2 { 0 } else { 1 + u8::from(d.z < 0.0) });
            }
        }
        Ok(Frame {
            index,
            number: index as u64,
            time_s: index as f64,
            color,
            depth,
            labels: Some(labels),
            truth: Some(pose),
        })
    }

    fn truth(&self, index: usize) -> Option<Pose> {
        let a = index as f64 * 0.03;
        let yaw = Pose::from_twist(&[0.4 * a.sin(), 0.4 * a.cos(), 0.1 * a, 0.0, 0.0, a]);
        let look = Pose::from_twist(&[0.0, 0.0, 0.0, -1.5, 0.0, 0.0]);
        Some(yaw.compose(&look))
    }

    fn time_s(&self, index: usize) -> f64 {
        index as f64
    }
}
