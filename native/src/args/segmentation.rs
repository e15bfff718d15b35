//! Classes from a network.
use clap::{Args, ValueHint};
use mte_slam_segment::{InputSize, Turn};

/// A segmentation network, and how it is used.
#[derive(Clone, Debug, Default, PartialEq, Args)]
pub struct SegmenterArgs {
    /// Take classes from a segmentation network in place of --labels: an .onnx file, or a folder with
    /// model.onnx, beside which config.json and preprocessor_config.json may say how it is used; or
    /// `built-in`, a small one that knows the rooms of `demo` and `synth`, and no real ones.
    #[arg(
        long,
        value_name = "MODEL|built-in",
        value_hint = ValueHint::AnyPath,
        help_heading = "Segmentation"
    )]
    pub segmenter: Option<String>,
    /// Size of the network's input [default: what its files say, else 384 pixels on the longest
    /// side].
    #[arg(long, value_name = "WxH", value_parser = input_size, help_heading = "Segmentation")]
    pub segment_size: Option<InputSize>,
    /// Label every N-th frame [default: as often as frames are mapped, `mapping.every`].
    #[arg(long, value_name = "N", value_parser = super::values::at_least_one, help_heading = "Segmentation")]
    pub segment_every: Option<usize>,
    /// Leave pixels unlabelled of whose class the network is less certain than this, 0 to 1.
    #[arg(long, value_name = "P", default_value = "0", value_parser = share, help_heading = "Segmentation")]
    pub min_confidence: f32,
    /// How the recording must be turned to be upright for the network; its classes are turned back.
    #[arg(
        long,
        value_name = "none|right|left|half",
        default_value = "none",
        value_parser = turn,
        help_heading = "Segmentation"
    )]
    pub turn: Turn,
    /// Threads of the network [default: one per core].
    #[arg(long, value_name = "N", value_parser = super::values::at_least_one, help_heading = "Segmentation")]
    pub segment_threads: Option<usize>,
    /// Merge classes into groups by their names, those of labels and true labels, too: `indoor`
    /// (built in), or a file {"armchair": "chair", "stool": "chair"}. Classes without a group are
    /// left out.
    #[arg(long, value_name = "indoor|FILE", help_heading = "Segmentation")]
    pub groups: Option<String>,
}

fn input_size(text: &str) -> Result<InputSize, String> {
    let expected = "expected width x height in pixels, for example 512x384";
    let (w, h) = text.split_once(['x', 'X']).ok_or(expected)?;
    match (w.trim().parse(), h.trim().parse()) {
        (Ok(width), Ok(height)) => Ok(InputSize { width, height }),
        _ => Err(expected.to_owned()),
    }
}

fn share(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(p) if (0.0..=1.0).contains(&p) => Ok(p),
        _ => Err("expected a number from 0 to 1".to_owned()),
    }
}

/// A turn by its name.
pub fn turn(text: &str) -> Result<Turn, String> {
    match text {
        "none" => Ok(Turn::None),
        "right" => Ok(Turn::Right),
        "left" => Ok(Turn::Left),
        "half" => Ok(Turn::Half),
        _ => Err("expected none, right (a quarter clockwise), left or half".to_owned()),
    }
}

/// The name of a turn.
pub fn turn_name(turn: Turn) -> &'static str {
    match turn {
        Turn::None => "none",
        Turn::Right => "right",
        Turn::Left => "left",
        Turn::Half => "half",
    }
}
