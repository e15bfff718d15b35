//! `config.toml`: the configuration with, in `[run]`, where it was used and on what.
use crate::{
    args::{ClassArgs, SegmenterArgs, SelectionArgs, SensorArgs, turn, turn_name},
    configuration,
    output::metrics::EngineRecord,
};
use anyhow::{Context, Result};
use mte_slam_core::config::Config;
use mte_slam_dataset::GivenCamera;
use mte_slam_segment::InputSize;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a run records beside its configuration. `--config` skips it, `eval` reads it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct RunRecord {
    /// Version of this program.
    pub version: String,
    /// Preset that the configuration started from.
    pub preset: String,
    /// Hash of the configuration.
    pub config_hash: String,
    /// The recording as given, or `built-in`.
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
    /// The camera given in place of the recording's, if any: fx fy cx cy k1 k2 p1 p2 k3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<Vec<f64>>,
    /// Units of depth per metre given in place of the recording's, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_scale: Option<f64>,
    /// Axes of the true poses' cameras, if given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<String>,
    /// Depth beyond it counts as not measured, if given \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<f64>,
    /// Order of listed frames, if given: `time` or `file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<String>,
    /// `none`, `dataset` or a folder.
    pub labels: String,
    /// Labels that classes were scored against: `none`, `dataset` or a folder.
    pub truth_labels: String,
    /// Folder of feature maps, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub features: Option<String>,
    /// The class list asked for, if any: `nyu40`, `replica` or a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classes: Option<String>,
    /// The id asked to mean "no label", if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unlabelled: Option<u16>,
    /// The network that made the labels, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segmenter: Option<SegmenterRecord>,
    /// Groups into which classes were merged, if any: `indoor` or a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groups: Option<String>,
    /// Focal length of the colour camera over that of the depth camera, as the map was trained.
    #[serde(rename = "colour_scale")]
    pub color_scale: f64,
    /// `gpu` or `cpu`.
    pub engine: String,
    /// Adapter, or processor architecture.
    pub adapter: String,
    /// Graphics interface.
    pub backend: String,
    /// Driver.
    pub driver: String,
}

/// A segmentation network, and how it was used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SegmenterRecord {
    /// The model as given.
    pub model: String,
    /// Width and height of its input, if given \[pixels\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[usize; 2]>,
    /// Step between the labelled frames, if given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<usize>,
    /// Least confidence of a label.
    pub min_confidence: String,
    /// What brings the images upright.
    pub turn: String,
}

impl SegmenterRecord {
    /// What the flags say, if they name a network.
    pub fn of(args: &SegmenterArgs) -> Option<SegmenterRecord> {
        Some(SegmenterRecord {
            model: args.segmenter.clone()?,
            size: args.segment_size.map(|s| [s.width, s.height]),
            every: args.segment_every,
            min_confidence: args.min_confidence.to_string(),
            turn: turn_name(args.turn).to_owned(),
        })
    }

    /// The flags that say so.
    fn selection(record: Option<&SegmenterRecord>, groups: Option<String>) -> SegmenterArgs {
        let Some(r) = record else { return SegmenterArgs { groups, ..SegmenterArgs::default() } };
        SegmenterArgs {
            segmenter: Some(r.model.clone()),
            segment_size: r.size.map(|[width, height]| InputSize { width, height }),
            segment_every: r.every,
            min_confidence: r.min_confidence.parse().unwrap_or(0.0),
            turn: turn(&r.turn).unwrap_or_default(),
            segment_threads: None,
            groups,
        }
    }
}

impl Default for RunRecord {
    fn default() -> Self {
        RunRecord {
            version: String::new(),
            preset: String::new(),
            config_hash: String::new(),
            dataset: String::new(),
            layout: String::new(),
            start: 0,
            stride: 1,
            frames: 0,
            scale: 1.0,
            camera: None,
            depth_scale: None,
            axes: None,
            max_depth: None,
            order: None,
            labels: "dataset".to_owned(),
            truth_labels: "dataset".to_owned(),
            features: None,
            classes: None,
            unlabelled: None,
            segmenter: None,
            groups: None,
            color_scale: 1.0,
            engine: String::new(),
            adapter: String::new(),
            backend: String::new(),
            driver: String::new(),
        }
    }
}

impl RunRecord {
    /// The flags that open the recording as the run did.
    pub fn selection(&self) -> SelectionArgs {
        SelectionArgs {
            layout: None,
            frames: (self.frames > 0).then_some(self.frames),
            stride: self.stride,
            start: self.start,
            scale: self.scale,
            sensor: SensorArgs {
                camera: self.camera.as_deref().and_then(GivenCamera::from_numbers),
                depth_scale: self.depth_scale,
                axes: self.axes.clone(),
                max_depth: self.max_depth,
                order: self.order.clone(),
                require_images: false,
            },
            labels: self.labels.clone(),
            truth_labels: None,
            features: None,
            classes: ClassArgs { classes: self.classes.clone(), unlabelled: self.unlabelled },
            segmentation: SegmenterRecord::selection(self.segmenter.as_ref(), self.groups.clone()),
        }
    }

    /// What the map learnt its classes from, for people and figures.
    pub fn labels_name(&self) -> String {
        match &self.segmenter {
            Some(segmenter) => format!("segmenter {}", segmenter.model),
            None => self.labels.clone(),
        }
    }

    /// Notes the engine.
    pub fn set_engine(&mut self, engine: &EngineRecord) {
        self.engine.clone_from(&engine.kind);
        self.adapter.clone_from(&engine.adapter);
        self.backend.clone_from(&engine.backend);
        self.driver.clone_from(&engine.driver);
    }
}

/// The text of config.toml.
pub fn config_file(config: &Config, run: &RunRecord) -> Result<String> {
    #[derive(Serialize)]
    struct Tail<'a> {
        run: &'a RunRecord,
    }
    let tail = toml::to_string(&Tail { run }).context("[run] cannot be written as TOML")?;
    Ok(format!(
        "# The complete configuration of a run; `--config` takes it back.\n\n{}\n\
         # Where and on what it ran, for the record; `--config` skips this.\n{tail}",
        configuration::to_toml(config)?
    ))
}

/// The `[run]` table of an output folder's config.toml, `None` without the file.
pub fn read_run(out: &Path) -> Result<Option<RunRecord>> {
    #[derive(Deserialize)]
    struct File {
        run: RunRecord,
    }
    let path = out.join("config.toml");
    if !path.is_file() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    let file: File = toml::from_str(&text)
        .with_context(|| format!("{}: found no valid [run] table", path.display()))?;
    Ok(Some(file.run))
}
