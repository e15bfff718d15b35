//! `ablation.json` and `ablation.md`: what each of the semantic modules brings, over seeds.
use crate::{
    metrics::{EngineRecord, SemanticFigures, SequenceRecord},
    text_table::table,
};
use mte_slam_core::{config::Head, slam::ParameterCounts};
use mte_slam_types::settings::Choice;
use serde::{Deserialize, Serialize, Serializer};
use std::{collections::BTreeMap, fmt::Write};

/// What makes two runs comparable; all of it must be equal for a kept run to be used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunKey {
    /// Name and version of the program.
    pub program: String,
    /// Row of the table.
    pub row: String,
    /// Seed.
    pub seed: u32,
    /// Hash of the row's configuration with that seed.
    pub config_hash: String,
    /// The recording as given.
    pub dataset: String,
    /// Layout of its files.
    pub layout: String,
    /// First frame taken.
    pub start: usize,
    /// Step between the frames taken.
    pub stride: usize,
    /// Frames taken.
    pub frames: usize,
    /// Factor on the images' size.
    pub scale: f64,
    /// Labels that the map learns from.
    pub labels: String,
    /// Labels that classes are scored against.
    pub truth_labels: String,
    /// Folder of feature maps.
    pub features: Option<String>,
    /// Class list asked for.
    pub classes: Option<String>,
    /// Id asked to mean "no label".
    pub unlabelled: Option<u16>,
    /// Step between the frames scored.
    pub render_every: usize,
    /// `gpu` or `cpu`.
    pub engine: String,
    /// Adapter, or processor architecture.
    pub adapter: String,
}

/// Figures of classes against the truth \[%\].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClassScores {
    /// Mean IoU over the classes with a non-empty union.
    pub miou_percent: f64,
    /// Mean IoU over the classes that occur in the truth.
    pub miou_of_true_classes_percent: f64,
    /// Share of the pixels with the right class.
    pub pixel_accuracy_percent: f64,
    /// Mean IoU of the thin and small classes.
    pub small_miou_percent: Option<f64>,
    /// Mean boundary IoU.
    pub boundary_iou_percent: Option<f64>,
    /// Mean F-score of the outlines.
    pub boundary_f_score_percent: Option<f64>,
    /// IoU by the class's name.
    pub iou_percent_by_name: BTreeMap<String, f64>,
}

impl ClassScores {
    /// The figures that the ablation keeps.
    pub fn of(figures: &SemanticFigures) -> ClassScores {
        let r = &figures.report;
        ClassScores {
            miou_percent: r.miou_percent,
            miou_of_true_classes_percent: r.miou_of_true_classes_percent,
            pixel_accuracy_percent: r.pixel_accuracy_percent,
            small_miou_percent: r.small_miou_percent,
            boundary_iou_percent: r.boundary.as_ref().map(|b| b.iou_percent),
            boundary_f_score_percent: r.boundary.as_ref().map(|b| b.f_score_percent),
            iou_percent_by_name: figures.iou_percent_by_name.clone(),
        }
    }
}

/// One finished run, as kept in `runs/`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FinishedRun {
    /// Of what.
    pub key: RunKey,
    /// Rendered classes.
    pub classes: ClassScores,
    /// The labels that the map learnt from, where the truth is another.
    pub input_labels: Option<ClassScores>,
    /// ATE RMSE after rigid alignment \[cm\]; `None` without true poses.
    pub ate_rmse_cm: Option<f64>,
    /// Rendered against measured depth \[cm\].
    pub depth_l1_cm: Option<f64>,
    /// Rendered against input colour \[dB\].
    pub psnr_db: Option<f64>,
    /// Frames that could not be tracked.
    pub lost_frames: usize,
    /// Mapping time per iteration, with what belongs to it \[s\]; `None` without iterations.
    pub mapping_iteration_s: Option<f64>,
    /// The last optimisation over all keyframes \[s\].
    pub finish_s: f64,
    /// The whole run \[s\].
    pub wall_s: f64,
    /// Numbers that decide a pixel's class.
    pub parameters: ParameterCounts,
    /// How many classes are thin and small, and below which share of the pixels \[%\].
    pub small_classes: (usize, f64),
    /// Their names.
    pub small_class_names: Vec<String>,
    /// What was assumed or met while reading and scoring.
    pub warnings: Vec<String>,
    /// Protocols of the figures.
    pub protocols: BTreeMap<String, String>,
}

/// Mean and spread of one figure over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OverSeeds {
    /// Mean.
    pub mean: f64,
    /// Sample standard deviation (divided by n - 1); `None` with one seed.
    pub standard_deviation: Option<f64>,
}

impl OverSeeds {
    /// Of no values, or where a seed has none: `None`.
    pub fn of(values: impl Iterator<Item = Option<f64>>) -> Option<OverSeeds> {
        let values: Vec<f64> = values.collect::<Option<_>>()?;
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
        let standard_deviation = (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt());
        Some(OverSeeds { mean, standard_deviation })
    }

    /// As tables show it: `mean ± spread`.
    pub fn text(&self, decimals: usize, factor: f64) -> String {
        let mean = self.mean * factor;
        match self.standard_deviation {
            Some(s) => format!("{mean:.decimals$} ± {:.decimals$}", s * factor),
            None => format!("{mean:.decimals$}"),
        }
    }
}

/// What a row switches.
#[derive(Clone, Debug, Serialize)]
pub struct Variant {
    /// Its name.
    pub name: String,
    /// Multi-tier feature fusion.
    pub fusion: bool,
    /// The fusion's local module.
    pub local: bool,
    /// Feature redundancy suppressor.
    pub suppressor: bool,
    /// What makes classes of features.
    #[serde(serialize_with = "choice_name")]
    pub head: Head,
}

/// Writes a choice under its name in a configuration.
fn choice_name<S: Serializer>(choice: &impl Choice, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(choice.names().get(choice.index()).copied().unwrap_or_default())
}

/// One row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What it is.
    #[serde(flatten)]
    pub variant: Variant,
    /// Figures by name, their units in the name.
    pub figures: BTreeMap<&'static str, OverSeeds>,
    /// IoU \[%\] of each class that every seed has.
    pub iou_percent_by_name: BTreeMap<String, OverSeeds>,
    /// Numbers that decide a pixel's class (anchors in use: largest of the seeds).
    pub parameters: ParameterCounts,
    /// All parts together, anchors at their bound.
    pub parameters_total: usize,
    /// Every seed's run.
    pub runs: Vec<FinishedRun>,
}

/// What a figure is called, how it is got, and how the table shows it.
struct Figure {
    key: &'static str,
    head: &'static str,
    decimals: usize,
    /// From the unit of the key to that of the head.
    factor: f64,
    of: fn(&FinishedRun) -> Option<f64>,
    of_labels: fn(&ClassScores) -> Option<f64>,
}

const fn figure(
    key: &'static str,
    head: &'static str,
    decimals: usize,
    of: fn(&FinishedRun) -> Option<f64>,
) -> Figure {
    Figure { key, head, decimals, factor: 1.0, of, of_labels: |_| None }
}

static FIGURES: [Figure; 9] = [
    Figure {
        of_labels: |c| Some(c.miou_percent),
        ..figure("miou_percent", "mIoU %", 2, |r| Some(r.classes.miou_percent))
    },
    Figure {
        of_labels: |c| Some(c.miou_of_true_classes_percent),
        ..figure("miou_of_true_classes_percent", "of true classes %", 2, |r| {
            Some(r.classes.miou_of_true_classes_percent)
        })
    },
    Figure {
        of_labels: |c| Some(c.pixel_accuracy_percent),
        ..figure("pixel_accuracy_percent", "pixels %", 2, |r| {
            Some(r.classes.pixel_accuracy_percent)
        })
    },
    Figure {
        of_labels: |c| c.small_miou_percent,
        ..figure("small_miou_percent", "small classes %", 2, |r| r.classes.small_miou_percent)
    },
    Figure {
        of_labels: |c| c.boundary_iou_percent,
        ..figure("boundary_iou_percent", "boundary IoU %", 2, |r| r.classes.boundary_iou_percent)
    },
    Figure {
        of_labels: |c| c.boundary_f_score_percent,
        ..figure("boundary_f_score_percent", "F-score %", 2, |r| r.classes.boundary_f_score_percent)
    },
    figure("ate_rmse_cm", "ATE cm", 3, |r| r.ate_rmse_cm),
    Figure {
        factor: 1000.0,
        ..figure("mapping_iteration_s", "ms per iteration", 1, |r| r.mapping_iteration_s)
    },
    figure("finish_s", "last optimisation s", 1, |r| Some(r.finish_s)),
];

/// Figures that only the JSON file has.
static MORE: [Figure; 3] = [
    figure("depth_l1_cm", "", 2, |r| r.depth_l1_cm),
    figure("psnr_db", "", 2, |r| r.psnr_db),
    figure("wall_s", "", 1, |r| Some(r.wall_s)),
];

impl Row {
    /// The runs of one row; `neither` are those of the row without modules, by the same seeds.
    pub fn new(variant: Variant, runs: Vec<FinishedRun>, neither: &[FinishedRun]) -> Row {
        let mut figures = BTreeMap::new();
        for f in FIGURES.iter().chain(&MORE) {
            if let Some(over) = OverSeeds::of(runs.iter().map(f.of)) {
                figures.insert(f.key, over);
            }
        }
        let gain = runs.iter().zip(neither);
        let gain = gain.map(|(a, b)| Some(a.classes.miou_percent - b.classes.miou_percent));
        let plain = !variant.fusion && !variant.suppressor && variant.head == Head::Ray;
        if !plain && let Some(over) = OverSeeds::of(gain) {
            figures.insert("miou_gain_over_neither_points", over);
        }
        let over_input =
            |r: &FinishedRun| Some(r.classes.miou_percent - r.input_labels.as_ref()?.miou_percent);
        if let Some(over) = OverSeeds::of(runs.iter().map(over_input)) {
            figures.insert("miou_gain_over_input_labels_points", over);
        }
        let names = runs.first().map(|r| r.classes.iou_percent_by_name.keys());
        let iou_percent_by_name = names
            .into_iter()
            .flatten()
            .filter_map(|name| {
                let of = |r: &FinishedRun| r.classes.iou_percent_by_name.get(name).copied();
                Some((name.clone(), OverSeeds::of(runs.iter().map(of))?))
            })
            .collect();
        let mut parameters = runs.first().map(|r| r.parameters).unwrap_or_default();
        let in_use = runs.iter().map(|r| r.parameters.anchors_in_use);
        parameters.anchors_in_use = in_use.max().unwrap_or(0);
        Row {
            variant,
            figures,
            iou_percent_by_name,
            parameters,
            parameters_total: parameters.total(),
            runs,
        }
    }
}

/// The whole ablation.
#[derive(Debug, Serialize)]
pub struct Ablation {
    /// Name and version of this program.
    pub program: String,
    /// What was read.
    pub sequence: SequenceRecord,
    /// Preset that the configuration started from.
    pub preset: String,
    /// Hash of the configuration before rows and seeds changed it.
    pub config_hash: String,
    /// What computed.
    pub engine: EngineRecord,
    /// Seeds of every row.
    pub seeds: Vec<u32>,
    /// Step between the frames scored.
    pub render_every: usize,
    /// The labels that the map learnt from, against the truth; none where they are the truth.
    pub input_labels: Option<ClassScores>,
    /// The rows asked for.
    pub rows: Vec<Row>,
    /// What the figures mean.
    pub protocols: BTreeMap<String, String>,
    /// What was assumed or met while reading and scoring.
    pub warnings: Vec<String>,
}

impl Ablation {
    /// The text of `ablation.json`.
    pub fn to_json(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// The text of `ablation.md`.
    pub fn to_markdown(&self) -> String {
        let s = &self.sequence;
        let mut text = format!("# Ablation on {}\n\n", s.name);
        let _ = writeln!(
            text,
            "{} frames of {}x{}, {} classes, labels `{}` scored against `{}`; preset `{}`, seeds 1 \
             to {}, {} ({}).\n",
            s.frames,
            s.width_pixels,
            s.height_pixels,
            s.classes,
            s.labels,
            s.truth_labels,
            self.preset,
            self.seeds.len(),
            self.engine.kind,
            self.engine.adapter
        );
        let mut head = vec!["row".to_owned()];
        head.extend(FIGURES.iter().map(|f| f.head.to_owned()));
        head.push("parameters".to_owned());
        let dash = || "-".to_owned();
        let mut lines = Vec::new();
        if let Some(input) = &self.input_labels {
            let mut line = vec!["input labels".to_owned()];
            let value = |f: &Figure| (f.of_labels)(input);
            line.extend(FIGURES.iter().map(|f| value(f).map_or_else(dash, |v| format!("{v:.2}"))));
            line.push(dash());
            lines.push(line);
        }
        for row in &self.rows {
            let mut line = vec![row.variant.name.clone()];
            line.extend(FIGURES.iter().map(|f| {
                row.figures.get(f.key).map_or_else(dash, |o| o.text(f.decimals, f.factor))
            }));
            line.push(row.parameters_total.to_string());
            lines.push(line);
        }
        text += &table(&head, &lines);

        let mut lines = Vec::new();
        for row in &self.rows {
            let gain = |key: &str| {
                let over: Option<&OverSeeds> = row.figures.get(key);
                over.map_or_else(dash, |o| o.text(2, 1.0))
            };
            let p = &row.parameters;
            let mut line = vec![row.variant.name.clone(), gain("miou_gain_over_neither_points")];
            line.push(gain("miou_gain_over_input_labels_points"));
            let parts = [p.semantic_planes, p.semantic_decoder, p.class_head, p.fusion, p.anchors];
            line.extend(parts.iter().map(usize::to_string));
            line.push(p.anchors_in_use.to_string());
            lines.push(line);
        }
        let head = [
            "row",
            "mIoU over neither",
            "over input labels",
            "semantic planes",
            "semantic decoder",
            "class head",
            "fusion",
            "anchors",
            "anchors in use",
        ];
        text += "\nGains in points, and parameters by part:\n\n";
        text += &table(&head.map(str::to_owned), &lines);
        text += &self.small_classes();
        text += "\n";
        for (what, protocol) in &self.protocols {
            let _ = writeln!(text, "- {what}: {protocol}");
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "- note: {warning}");
        }
        text
    }
}

impl Ablation {
    /// The IoU of every thin and small class, a column each; nothing where there are none.
    fn small_classes(&self) -> String {
        let first = self.rows.iter().find_map(|r| r.runs.first());
        let Some(names) = first.map(|r| &r.small_class_names).filter(|n| !n.is_empty()) else {
            return String::new();
        };
        let mut head = vec!["row".to_owned()];
        head.extend(names.iter().map(|n| format!("{n} %")));
        let dash = || "-".to_owned();
        let mut lines = Vec::new();
        if let Some(input) = &self.input_labels {
            let mut line = vec!["input labels".to_owned()];
            let iou = |n: &String| input.iou_percent_by_name.get(n);
            line.extend(names.iter().map(|n| iou(n).map_or_else(dash, |v| format!("{v:.1}"))));
            lines.push(line);
        }
        for row in &self.rows {
            let mut line = vec![row.variant.name.clone()];
            let iou = |n: &String| row.iou_percent_by_name.get(n);
            line.extend(names.iter().map(|n| iou(n).map_or_else(dash, |o| o.text(1, 1.0))));
            lines.push(line);
        }
        format!("\nIoU of the thin and small classes:\n\n{}", table(&head, &lines))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_spread() {
        let over = OverSeeds::of([1.0, 2.0, 6.0].into_iter().map(Some)).unwrap();
        assert_eq!((over.mean, over.standard_deviation), (3.0, Some(7.0_f64.sqrt())));
        assert_eq!(over.text(2, 10.0), "30.00 ± 26.46");
        let one = OverSeeds::of([Some(4.0)].into_iter()).unwrap();
        assert_eq!((one.text(1, 1.0), one.standard_deviation), ("4.0".to_owned(), None));
        // A seed without the figure leaves none: means over other seeds would not compare.
        assert!(OverSeeds::of([Some(4.0), None].into_iter()).is_none());
        assert!(OverSeeds::of(std::iter::empty()).is_none());
    }
}
