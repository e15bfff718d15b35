//! Writing recordings. Files go to a sink that takes a `/`-separated name and the bytes, so that
//! nothing here touches a disk; frames are numbered in the order in which they are written.
mod replica;
mod sens;
mod tum;

pub use replica::ReplicaWriter;
pub use sens::SensWriter;
pub use tum::TumWriter;

use image::{
    ExtendedColorType, ImageEncoder,
    codecs::{jpeg::JpegEncoder, png::PngEncoder},
};
use mte_slam_types::{
    classes::UNLABELLED,
    frame::{Frame, SequenceInfo},
};
use serde_json::json;

/// How colour images are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorFormat {
    /// JPEG of quality 95, as the originals.
    #[default]
    Jpeg,
    /// PNG: larger, and read back exactly.
    Png,
}

impl ColorFormat {
    /// Ending of a file's name, without the dot.
    pub fn ending(self) -> &'static str {
        match self {
            ColorFormat::Jpeg => "jpg",
            ColorFormat::Png => "png",
        }
    }
}

/// Why a frame could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The sink refused a file.
    #[error("{file}: cannot be written: {source}")]
    Sink {
        /// The file.
        file: String,
        /// What the sink said.
        source: std::io::Error,
    },
    /// An image could not be encoded.
    #[error("{file}: cannot be encoded: {reason}")]
    Encode {
        /// The file.
        file: String,
        /// What went wrong.
        reason: String,
    },
    /// A frame does not fit the sequence it is said to be of.
    #[error("frame {frame}: {field}: found {found}, expected {expected}")]
    Frame {
        /// The frame's index.
        frame: usize,
        /// For example `depth pixels`.
        field: &'static str,
        /// What was there.
        found: usize,
        /// What should be there.
        expected: usize,
    },
}

/// Writes a recording in some layout.
pub trait RecordingWriter {
    /// Writes the images of one frame.
    ///
    /// # Errors
    /// When an image has not the camera's size, a label is no class, or the sink refuses.
    fn write(&mut self, frame: &Frame) -> Result<(), WriteError>;

    /// Writes what belongs to the sequence as a whole. Returns the number of frames.
    ///
    /// # Errors
    /// When the sink refuses, or frames are missing.
    fn finish(self) -> Result<usize, WriteError>;
}

/// What all layouts share: encoding, label images, class list and bounds.
struct Files<F> {
    info: SequenceInfo,
    color: ColorFormat,
    sink: F,
    /// Raw id written for pixels without a label.
    void: u16,
}

impl<F: FnMut(&str, &[u8]) -> std::io::Result<()>> Files<F> {
    fn new(info: &SequenceInfo, color: ColorFormat, sink: F) -> Self {
        let taken = |id: &u16| info.classes.classes.iter().any(|c| c.raw_id == *id);
        // Of 255 classes at most, some id up to 255 is free.
        let void = (0..=255).find(|id| !taken(id)).unwrap_or(256);
        Self { info: info.clone(), color, sink, void }
    }

    /// Returns whether all images have the camera's size.
    fn check(&self, frame: &Frame) -> Result<(), WriteError> {
        let pixels = self.info.camera.pixels();
        let check = |field, found, expected| match found == expected {
            true => Ok(()),
            false => Err(WriteError::Frame { frame: frame.index, field, found, expected }),
        };
        check("colour pixels", frame.color.len(), pixels)?;
        check("depth pixels", frame.depth.len(), pixels)?;
        check("label pixels", frame.labels.as_ref().map_or(pixels, Vec::len), pixels)
    }

    /// Returns the bytes of the colour image; `file` is for messages.
    fn color(&self, file: &str, color: &[[u8; 3]]) -> Result<Vec<u8>, WriteError> {
        let mut bytes = Vec::new();
        let kind = ExtendedColorType::Rgb8;
        match self.color {
            ColorFormat::Jpeg => {
                let encoder = JpegEncoder::new_with_quality(&mut bytes, 95);
                self.encode(encoder, file, color.as_flattened(), kind)?;
            }
            ColorFormat::Png => {
                self.encode(PngEncoder::new(&mut bytes), file, color.as_flattened(), kind)?;
            }
        }
        Ok(bytes)
    }

    /// Writes depth in its own unit.
    fn put_depth(&mut self, file: &str, depth: &[u16]) -> Result<(), WriteError> {
        self.put_png(file, bytemuck::cast_slice(depth), ExtendedColorType::L16)
    }

    /// Writes labels, if there are any, as `semantic_class/semantic_class_%06d.png`.
    fn put_labels(&mut self, number: usize, frame: &Frame) -> Result<(), WriteError> {
        let Some(labels) = &frame.labels else { return Ok(()) };
        let classes = &self.info.classes.classes;
        let mut raw = Vec::with_capacity(labels.len());
        for &label in labels {
            raw.push(match classes.get(usize::from(label)) {
                Some(class) => class.raw_id,
                None if label == UNLABELLED => self.void,
                None => {
                    let (found, expected) = (label.into(), classes.len());
                    let (frame, field) = (frame.index, "class index");
                    return Err(WriteError::Frame { frame, field, found, expected });
                }
            });
        }
        let file = format!("semantic_class/semantic_class_{number:06}.png");
        let widest = classes.iter().map(|c| c.raw_id).max().unwrap_or(0).max(self.void);
        if widest < 256 {
            let bytes: Vec<u8> = raw.iter().map(|&id| id as u8).collect();
            self.put_png(&file, &bytes, ExtendedColorType::L8)
        } else {
            self.put_png(&file, bytemuck::cast_slice(&raw), ExtendedColorType::L16)
        }
    }

    /// Writes `classes.json` and `bound.json`, where there are classes and bounds.
    fn put_lists(&mut self) -> Result<(), WriteError> {
        if !self.info.classes.is_empty() {
            let entry = |name: &str, color: [u8; 3]| json!({"name": name, "color": color});
            let mut classes = serde_json::Map::new();
            classes.insert(self.void.to_string(), entry("void", [0; 3]));
            for class in &self.info.classes.classes {
                classes.insert(class.raw_id.to_string(), entry(&class.name, class.color));
            }
            self.put_json("classes.json", &classes.into())?;
        }
        if let Some(b) = self.info.bounds {
            let axis = |i: usize| [b.min[i], b.max[i]];
            self.put_json("bound.json", &json!({"bound": [axis(0), axis(1), axis(2)]}))?;
        }
        Ok(())
    }

    fn put_json(&mut self, file: &str, value: &serde_json::Value) -> Result<(), WriteError> {
        self.put(file, format!("{value:#}\n").as_bytes())
    }

    fn put_png(
        &mut self,
        file: &str,
        data: &[u8],
        kind: ExtendedColorType,
    ) -> Result<(), WriteError> {
        let mut bytes = Vec::new();
        self.encode(PngEncoder::new(&mut bytes), file, data, kind)?;
        self.put(file, &bytes)
    }

    fn encode(
        &self,
        encoder: impl ImageEncoder,
        file: &str,
        data: &[u8],
        kind: ExtendedColorType,
    ) -> Result<(), WriteError> {
        let (w, h) = (self.info.camera.width, self.info.camera.height);
        encoder
            .write_image(data, w, h, kind)
            .map_err(|e| WriteError::Encode { file: file.into(), reason: e.to_string() })
    }

    fn put(&mut self, file: &str, bytes: &[u8]) -> Result<(), WriteError> {
        (self.sink)(file, bytes).map_err(|source| WriteError::Sink { file: file.into(), source })
    }
}
