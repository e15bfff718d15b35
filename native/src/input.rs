//! Opening what is read.
use crate::{
    args::{ConfigArgs, SelectionArgs},
    class_truth::ClassTruth,
    configuration::{self, Configured},
    errors::usage,
    mesh_evaluation::MeshTruth,
    record::{RunRecord, SegmenterRecord},
    screen::Screen,
    segmentation,
    source::{self, has_ending},
};
use anyhow::{Error, Result};
use mte_slam_dataset::{Axes, ClassList, FrameOrder, LabelSource, Layout, OpenOptions};
use mte_slam_mesh::Mesh;
use mte_slam_synth::{SyntheticMesh, SyntheticOptions, SyntheticSequence};
use mte_slam_types::{
    classes::UNLABELLED,
    frame::SequenceInfo,
    sequence::{Sequence, SequenceError, Source},
};
use std::path::{Path, PathBuf};

/// A recording, how it is to be processed, and what its classes are scored against.
pub struct Prepared {
    /// The recording.
    pub sequence: Box<dyn Sequence>,
    /// The configuration.
    pub effective: Configured,
    /// Labels that classes are scored against.
    pub class_truth: ClassTruth,
    /// How it was opened.
    pub record: RunRecord,
}

/// Opens a recording with the configuration that the flags, or else its layout, ask for.
pub fn prepare(
    dataset: &Path,
    selection: &SelectionArgs,
    config: &ConfigArgs,
    screen: Screen,
) -> Result<Prepared> {
    // Everything that can be wrong with the command line comes before anything slow.
    let named = config.preset.is_some();
    let early = configuration::resolve(config, "replica")?;
    let sequence = open_recording(dataset, selection, screen)?;
    let default_preset = preset_of_layout(sequence.info().layout);
    let effective = if named || default_preset == early.preset {
        early
    } else {
        configuration::resolve(config, default_preset)?
    };
    // Labels of frames that are not mapped would do nothing, and most of those between are not.
    let every = effective.config.mapping.every as usize;
    let sequence = segmentation::labelled(sequence, &selection.segmentation, every, screen)?;
    let info = sequence.info();
    note_features(selection, info, screen);
    let class_truth = if info.classes.is_empty() {
        ClassTruth::none("there are no labels", info)
    } else {
        open_truth(dataset, selection, info)?
    };
    let record = RunRecord {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        preset: effective.preset.clone(),
        dataset: dataset.display().to_string(),
        layout: info.layout.to_owned(),
        start: selection.start,
        stride: selection.stride,
        frames: info.frames,
        scale: selection.scale,
        camera: selection.sensor.camera.map(|c| c.numbers()),
        depth_scale: selection.sensor.depth_scale,
        axes: selection.sensor.axes.clone(),
        max_depth: selection.sensor.max_depth,
        order: selection.sensor.order.clone(),
        labels: selection.labels.clone(),
        truth_labels: class_truth.name.clone(),
        features: selection.features.as_ref().map(|f| f.display().to_string()),
        classes: selection.classes.classes.clone(),
        unlabelled: selection.classes.unlabelled,
        segmenter: SegmenterRecord::of(&selection.segmentation),
        groups: selection.segmentation.groups.clone(),
        ..RunRecord::default()
    };
    Ok(Prepared { sequence, effective, class_truth, record })
}

/// The preset that suits a layout.
fn preset_of_layout(layout: &str) -> &'static str {
    match layout {
        // 7-Scenes is what ScanNet is: a real room at 30 Hz by a structured-light sensor.
        "7scenes" | "scannet" | "sens" | "nerfstudio" | "images" => "scannet",
        "tum" => "tum",
        _ => "replica",
    }
}

/// The recording's own name, also of `.`, `data/room/` and `room.zip`.
pub fn folder_name(path: &Path) -> String {
    let whole: PathBuf = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let packed = ["zip", "sens"].iter().any(|e| has_ending(&whole, e)) && whole.is_file();
    let name = if packed { whole.file_stem() } else { whole.file_name() };
    name.map_or("recording".to_owned(), |n| n.to_string_lossy().into_owned())
}

/// Opens a recording, with the labels that the flags ask for in every frame.
pub fn open(path: &Path, selection: &SelectionArgs, screen: Screen) -> Result<Box<dyn Sequence>> {
    let sequence = open_recording(path, selection, screen)?;
    let sequence = segmentation::labelled(sequence, &selection.segmentation, 1, screen)?;
    note_features(selection, sequence.info(), screen);
    Ok(sequence)
}

fn note_features(selection: &SelectionArgs, info: &SequenceInfo, screen: Screen) {
    if let Some(folder) = selection.features.as_deref().filter(|_| info.classes.is_empty()) {
        let name = folder.display();
        screen.note(&format!("note: {name}: feature maps do nothing without labels to learn from"));
    }
}

/// Opens a recording as its files are.
pub fn open_recording(
    path: &Path,
    selection: &SelectionArgs,
    screen: Screen,
) -> Result<Box<dyn Sequence>> {
    let segmented = selection.segmentation.segmenter.is_some();
    if segmented && selection.labels != "dataset" {
        usage!("--labels {}: expected either it or --segmenter", selection.labels);
    }
    let layout = selection.layout.as_deref().map(layout_named).transpose()?;
    let (source, skipped_links) = source::open(path)?;
    if let [first, ..] = skipped_links.as_slice() {
        let (name, n) = (path.display(), skipped_links.len());
        screen.note(&format!(
            "note: {name}: {n} links that lead out of it, such as {first}, are skipped"
        ));
    }
    let features = selection.features.as_deref();
    let labels = if segmented { "none" } else { &selection.labels };
    open_source(path, source, layout, labels, features, selection)
}

fn open_source(
    path: &Path,
    source: Box<dyn Source>,
    layout: Option<Layout>,
    labels: &str,
    features: Option<&Path>,
    selection: &SelectionArgs,
) -> Result<Box<dyn Sequence>> {
    let labels = match labels {
        "none" => LabelSource::None,
        "dataset" => LabelSource::Dataset,
        folder => LabelSource::Folder(source::open(Path::new(folder))?.0),
    };
    let axes = match selection.sensor.axes.as_deref() {
        None => Axes::default(),
        Some(name) => match Axes::named(name) {
            Some(axes) => axes,
            None => {
                usage!("--axes: found `{name}`, expected one of {}", Axes::NAMES.join(", "))
            }
        },
    };
    let order = match selection.sensor.order.as_deref() {
        None => FrameOrder::default(),
        Some(name) => match FrameOrder::named(name) {
            Some(order) => order,
            None => {
                usage!("--order: found `{name}`, expected one of {}", FrameOrder::NAMES.join(", "))
            }
        },
    };
    let options = OpenOptions {
        layout,
        camera: selection.sensor.camera,
        depth_scale: selection.sensor.depth_scale,
        axes,
        order,
        max_depth_m: selection.sensor.max_depth,
        strict: selection.sensor.require_images,
        start: selection.start,
        stride: selection.stride,
        frames: selection.frames,
        scale: selection.scale,
        labels,
        features: match features {
            Some(folder) => Some(source::open(folder)?.0),
            None => None,
        },
        classes: selection.classes.classes.as_deref().map(class_list).transpose()?,
        unlabelled_raw_id: selection.classes.unlabelled,
        ..OpenOptions::default()
    };
    mte_slam_dataset::open(source, options).map_err(|error| {
        if names_recording(&error, path) {
            Error::from(error)
        } else {
            Error::from(error).context(path.display().to_string())
        }
    })
}

/// Whether an error about a file names the recording, too; some name it below the folder only.
fn names_recording(error: &SequenceError, recording: &Path) -> bool {
    match error {
        SequenceError::Read { file, .. } | SequenceError::Invalid { file, .. } => {
            Path::new(file).starts_with(recording)
        }
        SequenceError::UnknownLayout { folder, .. } => Path::new(folder).starts_with(recording),
        _ => false,
    }
}

/// A built-in list of classes, or one from a file.
fn class_list(name: &str) -> Result<ClassList> {
    if let Some(list) = ClassList::built_in(name) {
        return Ok(list);
    }
    let built_in = ClassList::BUILT_IN.join(", ");
    let text = match std::fs::read_to_string(name) {
        Ok(text) => text,
        Err(e) => usage!("--classes {name}: {e}; expected one of {built_in}, or a readable file"),
    };
    Ok(ClassList::parse(name, &text)?)
}

/// The labels that classes are scored against, for the recording that `open` opened as `input`.
pub fn open_truth(
    path: &Path,
    selection: &SelectionArgs,
    input: &SequenceInfo,
) -> Result<ClassTruth> {
    let chosen = selection.truth_labels.as_deref();
    let wanted = match chosen {
        Some("none") => return Ok(ClassTruth::none("--truth-labels none was given", input)),
        Some(wanted) => wanted,
        None => "dataset",
    };
    let segmented = selection.segmentation.segmenter.is_some();
    if wanted == selection.labels && !segmented {
        if chosen.is_some() && input.classes.is_empty() {
            usage!("--truth-labels {wanted}: found no label images in the recording");
        }
        return Ok(ClassTruth::of_input(wanted, input));
    }
    let layout = selection.layout.as_deref().map(layout_named).transpose()?;
    let truth = open_source(path, source::open(path)?.0, layout, wanted, None, selection)?;
    let truth = segmentation::grouped(truth, &selection.segmentation)?;
    if truth.info().classes.is_empty() {
        if chosen.is_some() {
            usage!("--truth-labels {wanted}: found no label images in the recording");
        }
        if segmented {
            return Ok(ClassTruth::none("the recording has no labels of its own", input));
        }
        return Ok(ClassTruth::of_input(&selection.labels, input));
    }
    ClassTruth::of_sequence(wanted, truth, input)
}

fn layout_named(name: &str) -> Result<Layout> {
    if let Some(layout) = Layout::ALL.into_iter().find(|l| l.name() == name) {
        return Ok(layout);
    }
    let names = Layout::ALL.map(Layout::name).join(", ");
    usage!("--layout: found `{name}`, expected one of {names}");
}

/// The built-in sequence.
pub fn built_in(frames: usize, width: u32) -> SyntheticSequence {
    let height = width / 4 * 3;
    SyntheticSequence::new(SyntheticOptions { frames, width, height, ..Default::default() })
}

/// The built-in sequence's mesh as the core's mesh type; a vertex takes the class of its faces.
pub fn true_mesh(synthetic: SyntheticMesh) -> MeshTruth {
    let SyntheticMesh { positions, triangles, face_class, colors, .. } = synthetic;
    let mut classes = vec![UNLABELLED; positions.len()];
    for (triangle, class) in triangles.iter().zip(face_class) {
        for &i in triangle {
            classes[i as usize] = class;
        }
    }
    let mut mesh = Mesh { positions, triangles, colors, classes, ..Mesh::default() };
    mesh.compute_normals();
    MeshTruth { mesh }
}
