//! Writing a recording in the layout of Replica's NICE-SLAM render.
use crate::{
    classes::UNLABELLED,
    frame::{Frame, SequenceInfo},
};
use image::{
    ExtendedColorType, ImageEncoder,
    codecs::{jpeg::JpegEncoder, png::PngEncoder},
};
use serde_json::json;

/// How colour images are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorFormat {
    /// JPEG of quality 95, as the original.
    #[default]
    Jpeg,
    /// PNG: larger, and read back exactly.
    Png,
}

/// Why a frame could not be written.
#[derive(Debug, thiserror::Error)]
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

/// Writes frames as `results/frame%06d.jpg|png`, `results/depth%06d.png` and
/// `semantic_class/semantic_class_%06d.png`, and at the end `traj.txt`, `cam_params.json`,
/// `classes.json` and `bound.json`; [`super::open`] reads them back.
///
/// Files go to a sink that takes a `/`-separated name and the bytes, so that nothing here touches
/// a disk. Frames are numbered in the order in which they are written.
pub struct ReplicaWriter<F> {
    info: SequenceInfo,
    color: ColorFormat,
    sink: F,
    /// Raw id written for pixels without a label.
    void: u16,
    trajectory: String,
    written: usize,
}

impl<F: FnMut(&str, &[u8]) -> std::io::Result<()>> ReplicaWriter<F> {
    /// A writer of frames of the given sequence.
    pub fn new(info: &SequenceInfo, color: ColorFormat, sink: F) -> Self {
        let taken = |id: &u16| info.classes.classes.iter().any(|c| c.raw_id == *id);
        // Of 255 classes at most, some id up to 255 is free.
        let void = (0..=255).find(|id| !taken(id)).unwrap_or(256);
        let trajectory = String::new();
        Self { info: info.clone(), color, sink, void, trajectory, written: 0 }
    }

    /// Writes the images of one frame.
    ///
    /// # Errors
    /// When an image has not the camera's size, a label is no class, or the sink refuses.
    pub fn write(&mut self, frame: &Frame) -> Result<(), WriteError> {
        let (number, pixels) = (self.written, self.info.camera.pixels());
        let check = |field, found, expected| match found == expected {
            true => Ok(()),
            false => Err(WriteError::Frame { frame: frame.index, field, found, expected }),
        };
        check("colour pixels", frame.color.len(), pixels)?;
        check("depth pixels", frame.depth.len(), pixels)?;

        let color: &[u8] = frame.color.as_flattened();
        match self.color {
            ColorFormat::Jpeg => {
                let file = format!("results/frame{number:06}.jpg");
                let mut bytes = Vec::new();
                let encoder = JpegEncoder::new_with_quality(&mut bytes, 95);
                self.encode(encoder, &file, color, ExtendedColorType::Rgb8)?;
                self.put(&file, &bytes)?;
            }
            ColorFormat::Png => {
                let file = format!("results/frame{number:06}.png");
                self.png(&file, color, ExtendedColorType::Rgb8)?;
            }
        }
        let file = format!("results/depth{number:06}.png");
        self.png(&file, bytemuck::cast_slice(&frame.depth), ExtendedColorType::L16)?;

        if let Some(labels) = &frame.labels {
            check("label pixels", labels.len(), pixels)?;
            let classes = &self.info.classes.classes;
            let mut raw = Vec::with_capacity(pixels);
            for &label in labels {
                raw.push(match classes.get(usize::from(label)) {
                    Some(class) => class.raw_id,
                    None if label == UNLABELLED => self.void,
                    None => {
                        check("class index", label.into(), classes.len())?;
                        self.void
                    }
                });
            }
            let file = format!("semantic_class/semantic_class_{number:06}.png");
            let widest = classes.iter().map(|c| c.raw_id).max().unwrap_or(0).max(self.void);
            if widest < 256 {
                let bytes: Vec<u8> = raw.iter().map(|&id| id as u8).collect();
                self.png(&file, &bytes, ExtendedColorType::L8)?;
            } else {
                self.png(&file, bytemuck::cast_slice(&raw), ExtendedColorType::L16)?;
            }
        }

        // Without a pose the line says so the way ScanNet does.
        let row = frame.truth.map_or([f64::NEG_INFINITY; 16], |pose| pose.to_row_major());
        let words: Vec<String> = row.iter().map(|x| format!("{x:e}")).collect();
        self.trajectory += &words.join(" ");
        self.trajectory.push('\n');
        self.written += 1;
        Ok(())
    }

    /// Writes what belongs to the sequence as a whole. Returns the number of frames.
    ///
    /// # Errors
    /// When the sink refuses.
    pub fn finish(mut self) -> Result<usize, WriteError> {
        let trajectory = std::mem::take(&mut self.trajectory);
        self.put("traj.txt", trajectory.as_bytes())?;
        let c = self.info.camera;
        self.json(
            "cam_params.json",
            &json!({"camera": {
                "w": c.width, "h": c.height, "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy,
                "scale": 1.0 / self.info.depth_unit_m,
            }}),
        )?;
        if !self.info.classes.is_empty() {
            let entry = |name: &str, color: [u8; 3]| json!({"name": name, "color": color});
            let mut classes = serde_json::Map::new();
            classes.insert(self.void.to_string(), entry("void", [0; 3]));
            for class in &self.info.classes.classes {
                classes.insert(class.raw_id.to_string(), entry(&class.name, class.color));
            }
            self.json("classes.json", &classes.into())?;
        }
        if let Some(b) = self.info.bounds {
            let axis = |i: usize| [b.min[i], b.max[i]];
            self.json("bound.json", &json!({"bound": [axis(0), axis(1), axis(2)]}))?;
        }
        Ok(self.written)
    }

    fn json(&mut self, file: &str, value: &serde_json::Value) -> Result<(), WriteError> {
        self.put(file, format!("{value:#}\n").as_bytes())
    }

    fn png(&mut self, file: &str, data: &[u8], kind: ExtendedColorType) -> Result<(), WriteError> {
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
