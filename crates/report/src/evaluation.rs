//! The figures of a trajectory and of rendered views.
use crate::{
    class_truth::ClassTruth,
    metrics::{Metrics, RenderRecord, SemanticFigures},
    protocol::Protocol,
};
use anyhow::{Context, Result};
use mte_slam_core::slam::{PoseEstimate, View};
use mte_slam_metrics::{
    AteReport, ConfusionMatrix, ConsistencyMeter, DepthMeter, PosePair, PsnrMeter, SemanticMeter,
    TrajectoryError, align_rigid, ate,
};
use mte_slam_odometry::ColorRegistration;
use mte_slam_types::{
    classes::ClassTable,
    frame::{Frame, SequenceInfo},
    pose::Pose,
};
use std::borrow::Cow;

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
    changes: ConsistencyMeter,
    input_changes: ConsistencyMeter,
    frames: Vec<usize>,
    info: SequenceInfo,
    registration: ColorRegistration,
}

impl ViewScores {
    /// No views yet; classes will be scored against `truth`, colours and labels where
    /// `registration` puts them.
    pub fn new(
        info: &SequenceInfo,
        truth: ClassTruth,
        registration: ColorRegistration,
    ) -> ViewScores {
        ViewScores {
            depth: DepthMeter::default(),
            color: PsnrMeter::default(),
            classes: SemanticMeter::new(truth.table.len()),
            input_labels: SemanticMeter::new(truth.table.len()),
            changes: ConsistencyMeter::new(info.camera),
            input_changes: ConsistencyMeter::new(info.camera),
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

    /// Adds a view of `frame`, whose classes are those of the truth's table, as are `labels`, the
    /// true ones of the frame; both as [`ViewScores::registered`] gives them.
    pub fn add(&mut self, frame: &Frame, view: &View, labels: Option<&[u8]>) -> Result<()> {
        let place = || format!("scoring the view of frame {}", frame.index);
        self.depth.add(&view.depth_m, &frame.depth, self.info.depth_unit_m).with_context(place)?;
        self.color.add(&view.color, &frame.color).with_context(place)?;
        if let Some(labels) = labels {
            let width = self.info.camera.width as usize;
            self.classes.add(width, labels, &view.class).with_context(place)?;
            // A frame without labels says nothing about those of others.
            if let Some(input) = frame.labels.as_ref().filter(|_| self.truth.is_own()) {
                let input = self.truth.of_map(input);
                self.input_labels.add(width, labels, &input).with_context(place)?;
            }
        }
        self.frames.push(frame.index);
        Ok(())
    }

    /// Follows the classes of surfaces from the view before, of the map and of its labels: the view of `frame`
    /// at a pose, both as [`score_view`] gives them. Without it there are no figures of changes.
    pub fn follow(&mut self, frame: &Frame, view: &View, world_from_camera: &Pose) {
        let unit = self.info.depth_unit_m;
        let depth: Vec<f32> = frame.depth.iter().map(|d| (f64::from(*d) * unit) as f32).collect();
        self.changes.add(&depth, world_from_camera, &view.class);
        if let Some(labels) = &frame.labels {
            self.input_changes.add(&depth, world_from_camera, labels);
        }
    }

    /// Classes that are scored, and the counts so far.
    pub fn confusion(&self) -> (&ClassTable, &ConfusionMatrix) {
        (&self.truth.table, self.classes.confusion())
    }

    /// Puts the figures, or why there are none, into `metrics`. `unlabelled_id` is that of the
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
            color.protocol_id = Protocol::ColorViews { resampled: true }.id();
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
        metrics.class_changes = self.changes.report();
        metrics.input_class_changes = self.input_changes.report();
        if metrics.semantics.is_none() {
            let reason = self.truth.reason().unwrap_or("there are no labels");
            metrics.absent.insert("semantics", reason.to_owned());
        }
        metrics.warnings.extend(self.truth.warnings());
        metrics.renders = Some(RenderRecord {
            protocol: Protocol::Renders,
            frames: self.frames.clone(),
            unlabelled_id,
            classes_by: None,
        });
    }
}

/// Scores a view, whose classes become those of the truth's table. Returns the frame as the map was
/// trained with it, and its true labels.
///
/// # Errors
/// The true labels cannot be read, or an image has another size than the view.
pub fn score_view(
    scores: &mut ViewScores,
    frame: &Frame,
    view: &mut View,
) -> Result<(Frame, Option<Vec<u8>>)> {
    view.class = scores.truth().of_map(&view.class);
    let (trained, labels) = scores.registered(frame)?;
    scores.add(&trained, view, labels.as_deref())?;
    Ok((trained.into_owned(), labels))
}
