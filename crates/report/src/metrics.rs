//! `metrics.json`: every figure with its unit in the key and its protocol beside it, and the table
//! that people read at the end of a run.
use crate::{protocol::Protocol, timings::Spread};
use mte_slam_core::map::AnchorCounts;
use mte_slam_metrics::{
    AteReport, BoundaryReport, ConsistencyReport, DepthReport, MeshDepthReport, PsnrReport,
    SMALL_SHARE_PERCENT, SemanticReport, SurfaceReport,
};
use mte_slam_types::classes::{Class, ClassTable};
use serde::Serialize;
use std::collections::BTreeMap;

/// Everything that is reported. A section that could not be computed is absent, and `absent` says
/// why.
#[derive(Debug, Default, Serialize)]
pub struct Metrics {
    /// Name and version of this program.
    pub program: String,
    /// What was read.
    pub sequence: SequenceRecord,
    /// How it was processed; none in an evaluation of files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub configuration: Option<ConfigurationRecord>,
    /// What computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub engine: Option<EngineRecord>,
    /// Indices of the frames whose pose could not be tracked.
    pub lost_frames: Vec<usize>,
    /// What was assumed, skipped or masked while reading.
    pub warnings: Vec<String>,
    /// Trajectory error over all frames with a true pose, lost ones included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<AteReport>,
    /// The same without the lost frames, where there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory_without_lost: Option<AteReport>,
    /// What was rendered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub renders: Option<RenderRecord>,
    /// Rendered depth against the sensor's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthReport>,
    /// Rendered colour against the input.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<PsnrReport>,
    /// Rendered classes against the true labels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semantics: Option<SemanticFigures>,
    /// The labels that the map learnt from against the true labels, where those are others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_labels: Option<SemanticFigures>,
    /// How often the classes of a surface change from one rendered frame to the next: those of the map,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class_changes: Option<ConsistencyReport>,
    /// and those of the labels that it learnt from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_class_changes: Option<ConsistencyReport>,
    /// Classes of one frame by SNI-SLAM's protocol, for comparison only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semantics_sni: Option<SniFigures>,
    /// The same frames rendered again with the classes that `eval --inference` asks for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semantics_by_inference: Option<InferenceFigures>,
    /// Views from poses that the map never saw.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub novel_views: Option<NovelFigures>,
    /// What the redundancy suppressor did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub anchors: Option<AnchorFigures>,
    /// Mesh against the true mesh, after ESLAM's culling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<SurfaceReport>,
    /// The same after Co-SLAM's culling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_coslam: Option<SurfaceReport>,
    /// The same after NICE-SLAM's culling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_frustum: Option<SurfaceReport>,
    /// Depth L1 of the mesh by virtual views; not to be mixed with `depth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_depth: Option<MeshDepthReport>,
    /// Time per frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<TimeFigures>,
    /// Memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<MemoryFigures>,
    /// Section -> why it is not there.
    pub absent: BTreeMap<&'static str, String>,
}

/// What the redundancy suppressor did.
#[derive(Debug, Clone, Serialize)]
pub struct AnchorFigures {
    /// What the figures mean.
    #[serde(flatten)]
    pub protocol: Protocol,
    /// Most anchors there may be.
    pub limit: u32,
    /// At the end.
    #[serde(flatten)]
    pub last: AnchorCounts,
    /// (frame, anchors in use, spawned, dropped, merged), the last three counted from the start.
    pub history: Vec<(usize, u32, u32, u32, u32)>,
}

/// What was read.
#[derive(Debug, Default, Clone, Serialize)]
pub struct SequenceRecord {
    /// Name of the sequence.
    pub name: String,
    /// Layout of its files.
    pub layout: String,
    /// Frames processed.
    pub frames: usize,
    /// Width of the images as processed.
    pub width_pixels: u32,
    /// Height of the images as processed.
    pub height_pixels: u32,
    /// First frame taken.
    pub start: usize,
    /// Step between the frames taken.
    pub stride: usize,
    /// Factor on the images' size.
    pub scale: f64,
    /// `none`, `dataset` or a folder.
    pub labels: String,
    /// Labels that classes are scored against: `none`, `dataset` or a folder.
    pub truth_labels: String,
    /// Number of classes.
    pub classes: usize,
}

/// How it was processed.
#[derive(Debug, Clone, Serialize)]
pub struct ConfigurationRecord {
    /// Preset that the configuration started from.
    pub preset: String,
    /// Hash of all values (FNV-1a 64 of their TOML).
    pub hash: String,
    /// Seed.
    pub seed: u32,
    /// Tracker.
    pub tracker: String,
}

/// What computed.
#[derive(Debug, Clone, Serialize)]
pub struct EngineRecord {
    /// `gpu` or `cpu`.
    pub kind: String,
    /// Adapter, or processor architecture.
    pub adapter: String,
    /// Graphics interface.
    pub backend: String,
    /// Driver.
    pub driver: String,
}

/// Classes against true labels.
#[derive(Debug, Clone, Serialize)]
pub struct SemanticFigures {
    /// The true labels: `dataset` or a folder.
    pub truth: String,
    /// The figures.
    #[serde(flatten)]
    pub report: SemanticReport,
    /// Share of the true pixels below which a class counts as thin or small \[%\].
    pub small_share_percent: f64,
    /// IoU \[%\] by the class's name, of those with a non-empty union.
    pub iou_percent_by_name: BTreeMap<String, f64>,
    /// Every class that occurs in the truth or is predicted.
    pub classes: Vec<ClassFigures>,
}

/// One class.
#[derive(Debug, Clone, Serialize)]
pub struct ClassFigures {
    /// The id in the label images.
    pub id: u16,
    /// Its name.
    pub name: String,
    /// True pixels.
    pub pixels: u64,
    /// Whether it is a thin or small one.
    pub small: bool,
    /// IoU \[%\].
    pub iou_percent: f64,
    /// Share of its true pixels that are right \[%\].
    pub accuracy_percent: Option<f64>,
    /// Boundary IoU \[%\].
    pub boundary_iou_percent: Option<f64>,
    /// F-score of the outline \[%\].
    pub boundary_f_score_percent: Option<f64>,
}

impl SemanticFigures {
    /// The figures of `report`, whose compact classes are those of `table`.
    pub fn new(truth: &str, report: SemanticReport, table: &ClassTable) -> SemanticFigures {
        let of_boundary = |c: usize, f: fn(&BoundaryReport) -> &Vec<Option<f64>>| {
            report.boundary.as_ref().and_then(|b| f(b).get(c).copied().flatten())
        };
        let figures = |(c, class): (usize, &Class)| {
            Some(ClassFigures {
                id: class.raw_id,
                name: class.name.clone(),
                pixels: report.pixels_of_class[c],
                small: report.small_classes.iter().any(|&s| usize::from(s) == c),
                iou_percent: report.iou_percent[c]?,
                accuracy_percent: report.accuracy_percent_of_class[c],
                boundary_iou_percent: of_boundary(c, |b| &b.iou_percent_of_class),
                boundary_f_score_percent: of_boundary(c, |b| &b.f_score_percent_of_class),
            })
        };
        let classes: Vec<_> = table.classes.iter().enumerate().filter_map(figures).collect();
        SemanticFigures {
            truth: truth.to_owned(),
            small_share_percent: SMALL_SHARE_PERCENT,
            iou_percent_by_name: classes.iter().map(|c| (c.name.clone(), c.iou_percent)).collect(),
            classes,
            report,
        }
    }

    /// Names of the thin and small classes that have an IoU.
    pub fn small_class_names(&self) -> Vec<String> {
        self.classes.iter().filter(|c| c.small).map(|c| c.name.clone()).collect()
    }
}

/// Classes as SNI-SLAM's script evaluates them.
#[derive(Debug, Clone, Serialize)]
pub struct SniFigures {
    /// What the figures mean.
    #[serde(flatten)]
    pub protocol: Protocol,
    /// The frame.
    pub frame: usize,
    /// Mean IoU \[%\] over the classes with a non-empty union.
    pub miou_percent: f64,
    /// Number of classes in that mean.
    pub miou_classes: usize,
    /// Share of the pixels with the right class \[%\].
    pub pixel_accuracy_percent: f64,
}

/// Classes that a run's frames have by another source of classes than the run's.
#[derive(Debug, Clone, Serialize)]
pub struct InferenceFigures {
    /// `anchors` or `head`.
    pub inference: &'static str,
    /// The figures.
    #[serde(flatten)]
    pub semantics: SemanticFigures,
}

/// Views from poses that the map never saw.
#[derive(Debug, Clone, Serialize)]
pub struct NovelFigures {
    /// Id of the protocol.
    pub protocol_id: String,
    /// Where the views and their truth come from.
    pub protocol: String,
    /// Number of views.
    pub views: usize,
    /// Depth.
    pub depth: Option<DepthReport>,
    /// Colour.
    pub color: Option<PsnrReport>,
    /// Classes.
    pub semantics: Option<SemanticFigures>,
}

/// What was rendered.
#[derive(Debug, Clone, Serialize)]
pub struct RenderRecord {
    /// How the pictures were made.
    #[serde(flatten)]
    pub protocol: Protocol,
    /// Indices of the frames.
    pub frames: Vec<usize>,
    /// Id in the class pictures where there is no class.
    pub unlabelled_id: u16,
    /// What gave the pixels their classes: `anchors` or `head`; absent without classes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classes_by: Option<String>,
}

/// Time per frame.
#[derive(Debug, Clone, Serialize)]
pub struct TimeFigures {
    /// What is counted.
    #[serde(flatten)]
    pub protocol: Protocol,
    /// Tracking.
    pub tracking: Spread,
    /// Mapping, over the frames that were mapped.
    pub mapping: Spread,
    /// Both and what is between them.
    pub total: Spread,
    /// The last optimisation over all keyframes, which belongs to no frame \[s\].
    pub last_optimisation_s: f64,
    /// The whole program, with loading, evaluation and mesh; where a run was resumed, with the time
    /// until the checkpoint it was resumed from.
    pub wall_s: f64,
    /// What saving the run cost, where it was saved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checkpoints: Option<SavingFigures>,
}

/// What checkpoints cost.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct SavingFigures {
    /// How many were written since the last start.
    pub count: usize,
    /// Size of the last one.
    pub bytes: usize,
    /// Mean time of reading the device's state back, writing it and waiting for the disk \[s\].
    pub mean_s: f64,
}

/// Memory.
#[derive(Debug, Clone, Serialize)]
pub struct MemoryFigures {
    /// What is counted.
    #[serde(flatten)]
    pub protocol: Protocol,
    /// Peak resident memory of the process.
    pub peak_host_bytes: Option<u64>,
    /// Why that is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_host_unknown: Option<String>,
    /// Buffers of the engine at the end.
    pub device_bytes: u64,
    /// Most they have been together.
    pub peak_device_bytes: u64,
}

impl Metrics {
    /// The file's text.
    pub fn to_json(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absent_sections_say_why_and_json_has_units() {
        let mut m = Metrics { program: "p".to_owned(), ..Metrics::default() };
        m.lost_frames = (0..20).collect();
        m.absent.insert("mesh", "there is no true mesh".to_owned());
        let pose = mte_slam_types::pose::Pose::IDENTITY;
        let pair = mte_slam_metrics::PosePair { estimate: pose, truth: pose };
        m.trajectory = mte_slam_metrics::ate(&[pair; 4]).ok();
        let table = m.table();
        assert!(table.contains("no mesh: there is no true mesh"), "{table}");
        assert!(table.contains("0.000 cm") && table.contains("20 (0, 1"), "{table}");
        let json: serde_json::Value = serde_json::from_str(&m.to_json().unwrap()).unwrap();
        assert_eq!(json["trajectory"]["aligned_cm"]["rmse"], 0.0);
        assert!(json.get("depth").is_none());
    }
}
