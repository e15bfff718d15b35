//! Stand-in for the engine, the mesh and the SLAM loop: true poses with a little noise, pictures
//! of the nearest stored frame.
#![allow(missing_docs)]
use crate::{
    camera::Camera,
    config::Config,
    frame::{Frame, SequenceInfo},
    pose::Pose,
};
use alloc::{
    collections::BTreeMap,
    string::{String, ToString},
    vec::Vec,
};

#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct SlamError(pub String);

pub use crate::{engine::Engine, mesh::Mesh};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackingStatus {
    First,
    Tracked,
    Lost,
}

#[derive(Clone, Copy, Debug)]
pub struct PoseEstimate {
    pub frame: usize,
    pub time_s: f64,
    pub world_from_camera: Pose,
    pub status: TrackingStatus,
}

#[derive(Clone, Copy, Debug)]
pub struct Losses {
    pub total: f64,
    pub sdf: f64,
    pub depth: f64,
    pub color: f64,
    pub semantic: f64,
}

#[derive(Clone, Debug)]
pub struct FrameReport {
    pub status: TrackingStatus,
    pub world_from_camera: Pose,
    pub tracking_s: f64,
    pub mapping_s: f64,
    pub total_s: f64,
    pub losses: Option<Losses>,
    pub keyframe: bool,
}

#[derive(Clone, Debug)]
pub struct View {
    pub camera: Camera,
    pub color: Vec<[u8; 3]>,
    pub depth_m: Vec<f32>,
    pub class: Vec<u8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dtype {
    F32,
    U32,
}

#[derive(Clone, Debug)]
pub struct Tensor {
    pub name: String,
    pub dtype: Dtype,
    pub shape: Vec<usize>,
    pub bytes: Vec<u8>,
}

#[derive(Clone, Debug, Default)]
pub struct Checkpoint {
    pub tensors: Vec<Tensor>,
    pub metadata: BTreeMap<String, String>,
}

pub struct Slam {
    _engine: Engine,
    info: SequenceInfo,
    frames: Vec<(PoseEstimate, Option<Frame>)>,
}

impl Slam {
    pub async fn new(
        engine: Engine,
        _config: Config,
        info: &SequenceInfo,
    ) -> Result<Slam, SlamError> {
        Ok(Slam { _engine: engine, info: info.clone(), frames: Vec::new() })
    }

    pub async fn process(&mut self, frame: &Frame) -> Result<FrameReport, SlamError> {
        let status = match frame.index {
            0 => TrackingStatus::First,
            13 => TrackingStatus::Lost,
            _ => TrackingStatus::Tracked,
        };
        let mut pose = frame.truth.unwrap_or_default();
        pose.translation.x += 0.004 * (frame.index as f64 * 0.7).sin();
        pose.translation.z += 0.003 * (frame.index as f64 * 0.3).cos();
        let estimate = PoseEstimate {
            frame: frame.index,
            time_s: frame.time_s,
            world_from_camera: pose,
            status,
        };
        let stored = (frame.index % 5 == 0).then(|| frame.clone());
        self.frames.push((estimate, stored));
        Ok(FrameReport {
            status,
            world_from_camera: pose,
            tracking_s: 0.01,
            mapping_s: 0.02,
            total_s: 0.03,
            losses: Some(Losses { total: 1.0, sdf: 0.5, depth: 0.1, color: 0.2, semantic: 0.2 }),
            keyframe: false,
        })
    }

    pub async fn finish(&mut self) -> Result<(), SlamError> {
        Ok(())
    }

    pub fn trajectory(&self) -> Vec<PoseEstimate> {
        self.frames.iter().map(|f| f.0).collect()
    }

    pub async fn render(&mut self, pose: &Pose, camera: &Camera) -> Result<View, SlamError> {
        let nearest = self.frames.iter().filter_map(|f| f.1.as_ref()).min_by(|a, b| {
            let d =
                |f: &Frame| (f.truth.unwrap_or_default().translation - pose.translation).length();
            d(a).total_cmp(&d(b))
        });
        let n = camera.pixels();
        Ok(match nearest {
            None => View {
                camera: *camera,
                color: alloc::vec![[90, 90, 90]; n],
                depth_m: alloc::vec![1.0; n],
                class: alloc::vec![crate::classes::UNLABELLED; n],
            },
            Some(f) => View {
                camera: *camera,
                color: f.color.iter().map(|c| c.map(|v| v.saturating_add(5))).collect(),
                depth_m: (0..n)
                    .map(|i| {
                        let d = f64::from(f.depth[i]) * self.info.depth_unit_m;
                        (d * (1.0 + 0.01 * (i as f64 * 0.01).sin())) as f32
                    })
                    .collect(),
                class: match &f.labels {
                    Some(l) => (0..n).map(|i| l[(i + 3) % n]).collect(),
                    None => alloc::vec![crate::classes::UNLABELLED; n],
                },
            },
        })
    }

    pub async fn extract_mesh(
        &mut self,
        _resolution_m: f64,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Mesh, SlamError> {
        progress(0.5);
        let p = self.frames.first().map(|f| f.0.world_from_camera.translation).unwrap_or_default();
        let positions = (0..8u32)
            .map(|i| {
                [0, 1, 2].map(|k| p[k as usize] as f32 + if i >> k & 1 == 1 { 1.5 } else { -1.5 })
            })
            .collect();
        let quads =
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let mut mesh = Mesh {
            positions,
            colors: alloc::vec![[200, 100, 50]; 8],
            classes: alloc::vec![0; 8],
            triangles: quads
                .iter()
                .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
                .collect(),
            ..Mesh::default()
        };
        mesh.compute_normals();
        Ok(mesh)
    }

    pub fn checkpoint(&mut self) -> Result<Checkpoint, SlamError> {
        let bytes = (0..24u8).collect();
        Ok(Checkpoint {
            tensors: alloc::vec![Tensor {
                name: "planes.geometry".to_string(),
                dtype: Dtype::F32,
                shape: alloc::vec![2, 3],
                bytes,
            }],
            metadata: [("format".to_string(), "stub".to_string())].into(),
        })
    }

    pub async fn restore(engine: Engine, _checkpoint: &Checkpoint) -> Result<Slam, SlamError> {
        let info = SequenceInfo {
            name: "restored".into(),
            layout: "stub",
            camera: Camera { width: 4, height: 3, fx: 4.0, fy: 4.0, cx: 1.5, cy: 1.0 },
            depth_unit_m: 0.001,
            frames: 0,
            classes: Default::default(),
            bounds: None,
        };
        Ok(Slam { _engine: engine, info, frames: Vec::new() })
    }

    pub fn memory_bytes(&self) -> usize {
        123 << 20
    }
}

#[derive(Clone, Debug)]
pub struct BenchStage {
    pub name: String,
    pub milliseconds: f64,
}

#[derive(Clone, Debug)]
pub struct BenchReport {
    pub tracking: Vec<BenchStage>,
    pub tracking_iteration_ms: f64,
    pub mapping: Vec<BenchStage>,
    pub mapping_iteration_ms: f64,
}
