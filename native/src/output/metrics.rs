//! `metrics.json`: every figure with its unit in the key and its protocol beside it, and the table
//! that people read at the end of a run.
use super::timings::Spread;
use crate::resume::SavingFigures;
use mte_slam_core::map::AnchorCounts;
use mte_slam_metrics::{
    AteReport, BoundaryReport, DepthReport, MeshDepthReport, PsnrReport, SMALL_SHARE_PERCENT,
    SemanticReport, SurfaceReport,
};
use mte_slam_types::classes::{Class, ClassTable};
use serde::Serialize;
use std::{collections::BTreeMap, fmt::Write};

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
    /// Time a frame.
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
    pub protocol: &'static str,
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
    /// Every how many-th frame was taken.
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

    /// Rows of the table, their names after `prefix`.
    fn rows(&self, prefix: &str) -> Vec<(String, String)> {
        let r = &self.report;
        let mut rows = vec![
            ("mIoU".to_owned(), format!("{:.2} %", r.miou_percent)),
            ("pixel accuracy".to_owned(), format!("{:.2} %", r.pixel_accuracy_percent)),
        ];
        if let Some(small) = r.small_miou_percent {
            let n = r.small_classes.len();
            let name = format!("mIoU of {n} classes < {} %", self.small_share_percent);
            rows.push((name, format!("{small:.2} %")));
        }
        if let Some(b) = &r.boundary {
            let both = format!("{:.2}, {:.2} %", b.iou_percent, b.f_score_percent);
            rows.push(("boundary IoU, F-score".to_owned(), both));
        }
        rows.into_iter().map(|(name, value)| (format!("{prefix}{name}"), value)).collect()
    }

    /// A line a class, most frequent first; beside the IoU that of the `input` labels.
    fn class_table(&self, input: Option<&SemanticFigures>) -> String {
        let mut classes: Vec<&ClassFigures> = self.classes.iter().collect();
        classes.sort_by_key(|c| std::cmp::Reverse(c.pixels));
        let width = classes.iter().map(|c| c.name.chars().count()).max().unwrap_or(0).max(5);
        let figure = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{v:.1}"));
        let mut text = format!(
            "{:width$}  {:>5}  {:>8}  {:>6}{}  {:>8}  {:>12}  {:>7}\n",
            "class",
            "id",
            "pixels %",
            "IoU %",
            if input.is_some() { "   input" } else { "" },
            "accuracy",
            "boundary IoU",
            "F-score"
        );
        for c in classes {
            let of_input = input.map_or(String::new(), |i| {
                let same = i.classes.iter().find(|other| other.id == c.id);
                format!("  {:>6}", figure(same.map(|s| s.iou_percent)))
            });
            let share = 100.0 * c.pixels as f64 / self.report.pixels as f64;
            let _ = writeln!(
                text,
                "{:width$}  {:>5}  {share:>8.2}  {:>6.1}{of_input}  {:>8}  {:>12}  {:>7}",
                c.name,
                c.id,
                c.iou_percent,
                figure(c.accuracy_percent),
                figure(c.boundary_iou_percent),
                figure(c.boundary_f_score_percent)
            );
        }
        text
    }
}

/// Classes as SNI-SLAM's script evaluates them.
#[derive(Debug, Clone, Serialize)]
pub struct SniFigures {
    /// What the figures mean.
    pub protocol: &'static str,
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
    pub protocol: &'static str,
    /// Indices of the frames.
    pub frames: Vec<usize>,
    /// Id in the class pictures where there is no class.
    pub unlabelled_id: u16,
    /// What gave the pixels their classes: `anchors` or `head`; absent without classes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classes_by: Option<String>,
}

/// Time a frame.
#[derive(Debug, Clone, Serialize)]
pub struct TimeFigures {
    /// What is counted.
    pub protocol: &'static str,
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

/// Memory.
#[derive(Debug, Clone, Serialize)]
pub struct MemoryFigures {
    /// What is counted.
    pub protocol: &'static str,
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

    /// The table for people.
    pub fn table(&self) -> String {
        let mut rows: Vec<(String, String, &str)> = Vec::new();
        let mut row = |name: &str, value: String, protocol| {
            rows.push((name.to_owned(), value, protocol));
        };
        if let Some(t) = &self.trajectory {
            row("ATE RMSE, aligned", format!("{:.3} cm", t.aligned_cm.rmse), &t.protocol);
            row("ATE RMSE, unaligned", format!("{:.3} cm", t.unaligned_cm.rmse), "");
        }
        if let Some(t) = &self.trajectory_without_lost {
            row("ATE RMSE, aligned, not lost", format!("{:.3} cm", t.aligned_cm.rmse), "");
        }
        if let Some(d) = &self.depth {
            row("depth L1, views", format!("{:.2} cm", d.l1_cm), &d.protocol);
            row("depth bias, coverage", depth_detail(d), "");
        }
        if let Some(c) = &self.color {
            row("PSNR, views", format!("{:.2} dB", c.mean_of_psnr_db), &c.protocol);
        }
        if let Some(s) = &self.semantics {
            let boundary = s.report.boundary.as_ref();
            for (i, (name, value)) in s.rows("").into_iter().enumerate() {
                let protocol = match i {
                    0 => s.report.protocol.as_str(),
                    _ if name.starts_with("boundary") => boundary.map_or("", |b| &b.protocol),
                    _ => "",
                };
                row(&name, value, protocol);
            }
        }
        if let Some(s) = &self.semantics_sni {
            let value = format!("{:.2}, {:.2} %", s.miou_percent, s.pixel_accuracy_percent);
            row("SNI-SLAM's mIoU, pixels", value, s.protocol);
        }
        if let Some(s) = &self.semantics_by_inference {
            let r = &s.semantics.report;
            let of_true = r.miou_of_true_classes_percent;
            row(
                &format!("by {}: mIoU, of true classes", s.inference),
                format!("{:.2}, {of_true:.2} %", r.miou_percent),
                "the same frames rendered again",
            );
            let pixels = format!("{:.2} %", r.pixel_accuracy_percent);
            row(&format!("by {}: pixel accuracy", s.inference), pixels, "");
        }
        if let Some(n) = &self.novel_views {
            if let Some(s) = &n.semantics {
                row("novel views: mIoU", format!("{:.2} %", s.report.miou_percent), &n.protocol);
                let pixels = format!("{:.2} %", s.report.pixel_accuracy_percent);
                row("novel views: pixel accuracy", pixels, "");
            }
            let protocol = if n.semantics.is_none() { n.protocol.as_str() } else { "" };
            if let Some(d) = &n.depth {
                row("novel views: depth L1, views", format!("{:.2} cm", d.l1_cm), protocol);
            }
            if let Some(c) = &n.color {
                row("novel views: PSNR", format!("{:.2} dB", c.mean_of_psnr_db), "");
            }
        }
        if let Some(s) = &self.input_labels {
            for (i, (name, value)) in s.rows("input labels: ").into_iter().enumerate() {
                let protocol = "the labels that the map learnt from, in the rendered frames";
                row(&name, value, if i == 0 { protocol } else { "" });
            }
        }
        for (how, report) in
            [("Co-SLAM", &self.mesh_coslam), ("ESLAM", &self.mesh), ("frustum", &self.mesh_frustum)]
        {
            let Some(m) = report else { continue };
            for (i, (name, value)) in surface_rows(m).into_iter().enumerate() {
                row(&format!("{name} ({how})"), value, if i == 0 { &m.protocol } else { "" });
            }
        }
        if let Some(d) = &self.mesh_depth {
            row("depth L1, mesh", format!("{:.2} cm", d.l1_cm), &d.protocol);
            let both = format!("{:.2} cm, {:.1} %", d.l1_of_both_cm, d.missing_percent);
            row("where both are, mesh missing", both, "");
        }
        if let Some(t) = &self.time {
            let of = |s: &Spread| format!("{:.3} s (p95 {:.3})", s.median_s, s.p95_s);
            row("tracking a frame", of(&t.tracking), t.protocol);
            row("mapping a mapped frame", of(&t.mapping), "");
            row("total a frame", of(&t.total), "");
            row("last optimisation", format!("{:.1} s", t.last_optimisation_s), "");
            row("whole program", format!("{:.1} s", t.wall_s), "");
        }
        if let Some(m) = &self.memory {
            let mib = |b: u64| format!("{:.0} MiB", b as f64 / f64::from(1 << 20));
            let host = m.peak_host_bytes.map_or("unknown".to_owned(), mib);
            row("peak host memory", host, m.protocol);
            row("peak device buffers", mib(m.peak_device_bytes), "");
        }
        row("lost frames", lost_text(&self.lost_frames), "");
        let name_width = rows.iter().map(|r| r.0.len()).max().unwrap_or(0);
        let mut text = String::new();
        // Protocols are long: numbered, and listed below the figures they belong to.
        let mut protocols = Vec::new();
        for (name, value, protocol) in rows {
            let mut line = format!("{name:name_width$}  {value:26}");
            if !protocol.is_empty() {
                protocols.push(protocol);
                line += &format!("  [{}]", protocols.len());
            }
            let _ = writeln!(text, "{}", line.trim_end());
        }
        for (i, protocol) in protocols.iter().enumerate() {
            let _ = writeln!(text, "{}", wrapped(&format!("[{}] {protocol}", i + 1)));
        }
        if let Some(s) = &self.semantics {
            text += "\n";
            text += &s.class_table(self.input_labels.as_ref());
            text += "\n";
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "note: {warning}");
        }
        for (section, reason) in &self.absent {
            let _ = writeln!(text, "no {section}: {reason}");
        }
        text
    }
}

/// Lines of at most 96 characters; later ones indented.
fn wrapped(text: &str) -> String {
    let mut lines = String::new();
    let mut length = 0;
    for word in text.split(' ') {
        if length > 0 && length + 1 + word.len() > 96 {
            lines += "\n   ";
            length = 3;
        }
        if length > 0 {
            lines.push(' ');
            length += 1;
        }
        lines += word;
        length += word.len();
    }
    lines
}

/// Figures of a mesh, the peers' first.
fn surface_rows(m: &SurfaceReport) -> Vec<(&'static str, String)> {
    let (p, s) = (&m.point_to_point, &m.point_to_surface);
    let pair = |a: f64, b: f64| format!("{a:.2}, {b:.2} cm");
    vec![
        ("mesh accuracy, completion", pair(p.accuracy_cm, p.completion_cm)),
        ("completion ratio", format!("{:.1} %", p.completion_ratio_percent)),
        ("floor by sampling alone", format!("{:.2} cm", m.sampling_floor_cm)),
        ("exact, to the surface", pair(s.accuracy_cm, s.completion_cm)),
        ("exact completion ratio", format!("{:.1} %", s.completion_ratio_percent)),
    ]
}

fn depth_detail(d: &DepthReport) -> String {
    format!("{:+.2} cm, {:.1} %", d.bias_cm, 100.0 * d.coverage)
}

fn lost_text(lost: &[usize]) -> String {
    if lost.is_empty() {
        return "none".to_owned();
    }
    let shown: Vec<String> = lost.iter().take(12).map(usize::to_string).collect();
    let more = if lost.len() > shown.len() { ", ..." } else { "" };
    format!("{} ({}{more})", lost.len(), shown.join(", "))
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
