//! The files of a model: the network, and what is known of its input and output.
use crate::error::{SegmentError, invalid};
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Largest size of a model's file, unless an option says otherwise \[bytes\].
pub const MAX_MODEL_BYTES: u64 = 1 << 30;
/// More text than any configuration has \[bytes\].
const MAX_TEXT_BYTES: u64 = 8 << 20;
/// Where a folder's network may be.
const NAMES: [&str; 3] = ["model.onnx", "onnx/model.onnx", "model_quantized.onnx"];

/// A network and what lies beside it.
#[derive(Clone, Debug, Default)]
pub struct ModelFiles {
    /// The network's file, for messages.
    pub name: String,
    /// The network.
    pub onnx: Vec<u8>,
    /// `config.json`: names of the classes (`id2label`), as Hugging Face has it. Two keys of our own:
    /// `raw_ids`, the ids of the classes in label images, and `colors`.
    pub config: Option<String>,
    /// `preprocessor_config.json`: how images become the network's input.
    pub preprocessor: Option<String>,
}

impl ModelFiles {
    /// The network that comes with this crate, for the built-in rooms: see its
    /// [model card](https://docs.rs/crate/mte-slam-segment/latest/source/models/built-in/README.md).
    #[cfg(feature = "built-in")]
    pub fn built_in() -> ModelFiles {
        ModelFiles {
            name: "built-in".into(),
            onnx: include_bytes!("../models/built-in/model.onnx").to_vec(),
            config: Some(include_str!("../models/built-in/config.json").into()),
            preprocessor: Some(include_str!("../models/built-in/preprocessor_config.json").into()),
        }
    }

    /// Reads a folder with `model.onnx` (or `onnx/model.onnx`, or a single `.onnx`), or an `.onnx` file.
    /// The two JSON files are looked for beside it and one folder up.
    ///
    /// # Errors
    /// [`SegmentError`] when there is no network, several, or one of more than `max_bytes`.
    pub fn open(path: &Path, max_bytes: u64) -> Result<ModelFiles, SegmentError> {
        let kind = fs::metadata(path).map_err(|e| read(path, &e))?;
        let file = if kind.is_dir() { find(path)? } else { path.to_owned() };
        let size = fs::metadata(&file).map_err(|e| read(&file, &e))?.len();
        let name = file.display().to_string();
        if size > max_bytes {
            return Err(SegmentError::TooLarge { file: name, bytes: size, limit: max_bytes });
        }
        let onnx = fs::read(&file).map_err(|e| read(&file, &e))?;
        let beside = |text: &str| -> Result<Option<String>, SegmentError> {
            let folder = file.parent().unwrap_or(Path::new("."));
            for path in [folder.join(text), folder.join("..").join(text)] {
                let Ok(found) = fs::metadata(&path) else { continue };
                if found.len() > MAX_TEXT_BYTES {
                    let limit = format!("at most {MAX_TEXT_BYTES} bytes");
                    return Err(invalid(&path.display().to_string(), "size", found.len(), limit));
                }
                return fs::read_to_string(&path).map(Some).map_err(|e| read(&path, &e));
            }
            Ok(None)
        };
        let (config, preprocessor) = (beside("config.json")?, beside("preprocessor_config.json")?);
        Ok(ModelFiles { name, onnx, config, preprocessor })
    }
}

fn read(path: &Path, error: &io::Error) -> SegmentError {
    let reason = match error.kind() {
        io::ErrorKind::NotFound => "no such file or folder".to_owned(),
        _ => error.to_string(),
    };
    SegmentError::Read { file: path.display().to_string(), reason }
}

/// The network in a folder.
fn find(folder: &Path) -> Result<PathBuf, SegmentError> {
    for name in NAMES {
        let path = folder.join(name);
        if path.is_file() {
            return Ok(path);
        }
    }
    let entries = fs::read_dir(folder).map_err(|e| read(folder, &e))?;
    let is_onnx = |p: &PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("onnx"));
    let mut found: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_onnx).collect();
    found.sort();
    let name = folder.display().to_string();
    match found.len() {
        1 => Ok(found.swap_remove(0)),
        0 => Err(invalid(&name, "network", "no .onnx file", "model.onnx")),
        n => Err(invalid(&name, "network", format!("{n} .onnx files"), "one, or model.onnx")),
    }
}
