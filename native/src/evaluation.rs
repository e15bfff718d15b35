//! The figures of a run, by the core's metrics.
use crate::{
    class_truth::ClassTruth,
    output::metrics::{Metrics, RenderRecord, SemanticFigures},
};
use anyhow::{Context, Result, bail};
use mte_slam_core::{
    classes::ClassTable,
    frame::{Frame, SequenceInfo},
    mesh::{self, CullProtocol, Keep, Mesh, Visibility},
    metrics::{
        self, AteReport, ConfusionMatrix, DepthMeter, PosePair, PsnrMeter, SemanticMeter,
        SurfaceOptions, SurfaceReport, TrajectoryError, align_rigid, ate, evaluate_surface,
    },
    pose::Pose,
    sequence::Sequence,
    slam::{PoseEstimate, View},
    track::odometry::ColourRegistration,
};
use std::{borrow::Cow, path::Path};

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
    truth: ClassTruth,
    classes: SemanticMeter,
    input_labels: SemanticMeter,
    frames: Vec<usize>,
    info: SequenceInfo,
    registration: ColourRegistration,
}

impl ViewScores {
    /// No views yet; classes will be scored against `truth`, colours and labels where
    /// `registration` puts them.
    pub fn new(
        info: &SequenceInfo,
        truth: ClassTruth,
        registration: ColourRegistration,
    ) -> ViewScores {
        ViewScores {
            depth: DepthMeter::default(),
            color: PsnrMeter::default(),
            classes: SemanticMeter::new(truth.table.len()),
            input_labels: SemanticMeter::new(truth.table.len()),
            truth,
            frames: Vec::new(),
            info: info.clone(),
            registration,
        }
    }

    /// What is scored against.
    pub fn truth(&mut self) -> &mut ClassTruth {
        &mut self.truth
    }

    /// The truth back, for the scores of another map.
    pub fn into_truth(self) -> ClassTruth {
        self.truth
    }

    /// A frame as the map was trained with it, and its true labels likewise: resampled to the depth
    /// camera where the colour camera has another focal length.
    pub fn registered<'a>(
        &mut self,
        frame: &'a Frame,
    ) -> Result<(Cow<'a, Frame>, Option<Vec<u8>>)> {
        let mut labels = self.truth.of_frame(frame)?;
        let (registration, camera) = (self.registration, &self.info.camera);
        if !registration.is_identity()
            && let Some(true_labels) = labels.take_if(|l| l.len() == camera.pixels())
        {
            let frame = Frame { labels: Some(true_labels), ..frame.clone() };
            labels = registration.registered(&frame, camera).into_owned().labels;
        }
        Ok((registration.registered(frame, camera), labels))
    }

    /// Add a view of `frame`, whose classes are those of the truth's table, as are `labels`, the
    /// true ones of the frame; both as [`ViewScores::registered`] gives them.
    pub fn add(&mut self, frame: &Frame, view: &View, labels: Option<&[u8]>) -> Result<()> {
        let place = || format!("scoring the view of frame {}", frame.index);
        self.depth.add(&view.depth_m, &frame.depth, self.info.depth_unit_m).with_context(place)?;
        self.color.add(&view.color, &frame.color).with_context(place)?;
        if let Some(labels) = labels {
            let width = self.info.camera.width as usize;
            self.classes.add(width, labels, &view.class).with_context(place)?;
            // A frame without labels tells nothing about those that there are.
            if let Some(input) = frame.labels.as_ref().filter(|_| self.truth.is_own()) {
                let input = self.truth.of_map(input);
                self.input_labels.add(width, labels, &input).with_context(place)?;
            }
        }
        self.frames.push(frame.index);
        Ok(())
    }

    /// Classes that are scored, and the counts so far.
    pub fn confusion(&self) -> (&ClassTable, &ConfusionMatrix) {
        (&self.truth.table, self.classes.confusion())
    }

    /// Put the figures, or why there are none, into `metrics`. `unlabelled_id` is that of the
    /// class pictures.
    pub fn report(&mut self, unlabelled_id: u16, metrics: &mut Metrics) {
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
        let scale = self.registration.scale;
        if let (Some(color), false) = (&mut metrics.color, self.registration.is_identity()) {
            color.protocol += &format!(
                "; against the input resampled to the depth camera, as the map was trained \
                 (colour focal length {scale:.3} of the depth camera's, found from the images)"
            );
        }
        let figures = |meter: &SemanticMeter| {
            let report = meter.report()?;
            Some(SemanticFigures::new(&self.truth.name, report, &self.truth.table))
        };
        metrics.semantics = figures(&self.classes);
        metrics.input_labels = figures(&self.input_labels);
        if metrics.semantics.is_none() {
            let reason = self.truth.reason().unwrap_or("there are no labels");
            metrics.absent.insert("semantics", reason.to_owned());
        }
        metrics.warnings.extend(self.truth.warnings());
        metrics.renders = Some(RenderRecord {
            protocol: "at estimated poses, without depth input",
            frames: self.frames.clone(),
            unlabelled_id,
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

/// ESLAM's culling: in a frame, and no deeper than its measured depth plus the truncation.
pub const CULL_ESLAM: CullProtocol = CullProtocol::SensorDepth { truncation_m: 0.06 };
/// Co-SLAM's culling: in a frame's frustum, and not hidden in a rendering of the mesh itself.
pub const CULL_COSLAM: CullProtocol = CullProtocol::RenderedDepth { tolerance_m: 0.03 };
/// Frames that decide what was observed; more of a long sequence add little.
const CULLING_VIEWS: usize = 200;

/// Compare a mesh with the true one, both culled to what frames at true poses observed. `icp`
/// aligns ours to the true one first.
pub fn mesh(
    mut ours: Mesh,
    truth: MeshTruth,
    sequence: &mut dyn Sequence,
    protocol: CullProtocol,
    icp: bool,
) -> Result<SurfaceReport> {
    let info = sequence.info().clone();
    let mut true_mesh = truth.mesh;
    let mut seen_of_ours = Visibility::new(&ours);
    let mut seen_of_truth = Visibility::new(&true_mesh);
    let stride = info.frames.div_ceil(CULLING_VIEWS).max(1);
    let mut views = 0;
    for index in (0..info.frames).step_by(stride) {
        let Some(world_from_camera) = sequence.truth(index) else { continue };
        let frame = sequence.frame(index)?;
        let view = mesh::View {
            camera: &info.camera,
            world_from_camera,
            depth: &frame.depth,
            depth_unit_m: info.depth_unit_m,
        };
        seen_of_ours.add_view(&ours, &view, protocol);
        seen_of_truth.add_view(&true_mesh, &view, protocol);
        views += 1;
    }
    if views == 0 {
        bail!("no frame has a true pose, so what was observed is not known");
    }
    mesh::cull(&mut ours, &seen_of_ours, Keep::AnySeen);
    mesh::cull(&mut true_mesh, &seen_of_truth, Keep::AnySeen);
    let options = SurfaceOptions::default();
    if icp {
        let aligned = metrics::icp(&ours, &true_mesh, 0.1, options.seed)?;
        ours.transform(&aligned);
    }
    let mut report = evaluate_surface(&ours, &true_mesh, &options)?;
    let alignment = if icp { "after ICP" } else { "no alignment" };
    report.protocol =
        format!("{}; {} in {views} views; {alignment}", report.protocol, protocol.name());
    Ok(report)
}
