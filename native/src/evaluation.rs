//! The figures of a run, by the core's metrics.
use crate::output::{
    metrics::{MeshFigures, Metrics, RenderRecord, SemanticFigures},
    pictures::unlabelled_id,
};
use anyhow::{Context, Result, bail};
use mte_slam_core::{
    frame::{Frame, SequenceInfo},
    mesh::{self, Mesh},
    metrics::{
        AteReport, ConfusionMatrix, DepthMeter, PosePair, PsnrMeter, TrajectoryError, align_rigid,
        ate,
    },
    pose::Pose,
    slam::{PoseEstimate, View},
};
use std::path::Path;

/// A trajectory's error.
pub struct TrajectoryScore {
    /// The figures.
    pub report: AteReport,
    /// The alignment that they were computed with.
    pub truth_from_estimate: Pose,
}

/// Error of the estimates that `keep` keeps and whose truth is known.
pub fn trajectory(
    estimates: &[PoseEstimate],
    truth: &[Option<Pose>],
    keep: impl Fn(&PoseEstimate) -> bool,
) -> Result<TrajectoryScore, TrajectoryError> {
    let pairs: Vec<PosePair> = estimates
        .iter()
        .zip(truth)
        .filter(|(e, _)| keep(e))
        .filter_map(|(e, t)| Some(PosePair { estimate: e.world_from_camera, truth: (*t)? }))
        .collect();
    trajectory_of_pairs(&pairs)
}

/// Error of pairs.
pub fn trajectory_of_pairs(pairs: &[PosePair]) -> Result<TrajectoryScore, TrajectoryError> {
    let report = ate(pairs)?;
    let estimate: Vec<_> = pairs.iter().map(|p| p.estimate.translation).collect();
    let truth: Vec<_> = pairs.iter().map(|p| p.truth.translation).collect();
    let alignment = align_rigid(&estimate, &truth)?;
    Ok(TrajectoryScore { report, truth_from_estimate: alignment.target_from_source })
}

/// Collects the scores of rendered views.
pub struct ViewScores {
    depth: DepthMeter,
    color: PsnrMeter,
    classes: ConfusionMatrix,
    frames: Vec<usize>,
    info: SequenceInfo,
}

impl ViewScores {
    /// No views yet.
    pub fn new(info: &SequenceInfo) -> ViewScores {
        ViewScores {
            depth: DepthMeter::default(),
            color: PsnrMeter::default(),
            classes: ConfusionMatrix::new(info.classes.len()),
            frames: Vec::new(),
            info: info.clone(),
        }
    }

    /// Add a view of `frame`.
    pub fn add(&mut self, frame: &Frame, view: &View) -> Result<()> {
        let place = || format!("scoring the view of frame {}", frame.index);
        self.depth.add(&view.depth_m, &frame.depth, self.info.depth_unit_m).with_context(place)?;
        self.color.add(&view.color, &frame.color).with_context(place)?;
        if let Some(labels) = &frame.labels {
            self.classes.add(labels, &view.class).with_context(place)?;
        }
        self.frames.push(frame.index);
        Ok(())
    }

    /// Put the figures, or why there are none, into `metrics`.
    pub fn report(self, metrics: &mut Metrics) {
        if self.frames.is_empty() {
            for section in ["depth", "color", "semantics"] {
                metrics.absent.insert(section, "no frame was rendered".to_owned());
            }
            return;
        }
        metrics.depth = self.depth.report();
        if metrics.depth.is_none() {
            let reason = "no pixel has both a measured and a rendered depth";
            metrics.absent.insert("depth", reason.to_owned());
        }
        metrics.color = self.color.report();
        match self.classes.report() {
            Some(report) => {
                let classes = self.info.classes.classes.iter().zip(&report.iou_percent);
                let iou_percent_by_name =
                    classes.filter_map(|(c, iou)| Some((c.name.clone(), (*iou)?))).collect();
                metrics.semantics = Some(SemanticFigures { report, iou_percent_by_name });
            }
            None => {
                metrics.absent.insert("semantics", "there are no labels".to_owned());
            }
        }
        metrics.renders = Some(RenderRecord {
            protocol: "at estimated poses, without depth input",
            frames: self.frames,
            unlabelled_id: unlabelled_id(&self.info.classes),
        });
    }
}

/// A true mesh.
pub struct MeshTruth {
    /// The mesh, in the world frame of the true poses.
    pub mesh: Mesh,
}

impl MeshTruth {
    /// Read a PLY file.
    pub fn read(path: &Path) -> Result<MeshTruth> {
        let name = path.display();
        let bytes =
            std::fs::read(path).with_context(|| format!("{name}: the true mesh cannot be read"))?;
        let mesh =
            mesh::read_ply(&bytes).with_context(|| format!("{name}: not a mesh in PLY format"))?;
        if mesh.triangles.is_empty() {
            bail!("{name}: the true mesh: found no faces, expected a triangle mesh");
        }
        Ok(MeshTruth { mesh })
    }

    /// The mesh of `flag`, or else `mesh.ply` in the recording's folder, or why there is none.
    /// A file that is there but unreadable is an error.
    pub fn find(flag: Option<&Path>, dataset: &Path) -> Result<Result<MeshTruth, String>> {
        if let Some(path) = flag {
            return Ok(Ok(MeshTruth::read(path)?));
        }
        let path = dataset.join("mesh.ply");
        if path.is_file() {
            return Ok(Ok(MeshTruth::read(&path)?));
        }
        Ok(Err(format!("there is no true mesh ({}; --mesh names another)", path.display())))
    }
}

/// Compare a mesh with the true one, over what the true poses' views observed.
pub fn mesh(
    _mesh: Mesh,
    _truth: MeshTruth,
    _poses: &[Option<Pose>],
    _info: &SequenceInfo,
) -> Result<MeshFigures> {
    bail!("not compared yet")
}
