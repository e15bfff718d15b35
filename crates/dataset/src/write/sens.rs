//! ScanNet's packed layout, with labels beside it.
use super::{ColorFormat, Files, RecordingWriter, WriteError};
use flate2::{Compression, write::ZlibEncoder};
use mte_slam_types::frame::{Frame, SequenceInfo};
use std::io::Write;

/// Writes frames into one `.sens` stream (version 4; colour as JPEG or PNG, depth by zlib) as they
/// come; with labels `semantic_class/` and `classes.json` go to the sink of files beside it.
pub struct SensWriter<W, F> {
    stream: W,
    files: Files<F>,
    /// The stream's name, for messages.
    name: String,
    written: usize,
    begun: bool,
}

impl<W: Write, F: FnMut(&str, &[u8]) -> std::io::Result<()>> SensWriter<W, F> {
    /// Returns a writer of exactly as many frames as `info` says: their number stands at the front.
    pub fn new(info: &SequenceInfo, color: ColorFormat, name: &str, stream: W, sink: F) -> Self {
        let files = Files::new(info, color, sink);
        Self { stream, files, name: name.into(), written: 0, begun: false }
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        let failed = |source| WriteError::Sink { file: self.name.clone(), source };
        self.stream.write_all(bytes).map_err(failed)
    }

    fn begin(&mut self) -> Result<(), WriteError> {
        const SENSOR: &[u8] = b"mte-slam";
        let info = &self.files.info;
        let c = info.camera;
        let camera = [
            [c.fx, 0.0, c.cx, 0.0],
            [0.0, c.fy, c.cy, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let identity = [0, 1, 2, 3].map(|i| [0, 1, 2, 3].map(|j| f64::from(u8::from(i == j))));
        let mut bytes = 4u32.to_le_bytes().to_vec();
        bytes.extend((SENSOR.len() as u64).to_le_bytes());
        bytes.extend(SENSOR);
        for number in [camera, identity, camera, identity].as_flattened().as_flattened() {
            bytes.extend((*number as f32).to_le_bytes());
        }
        let color = match self.files.color {
            ColorFormat::Png => 1i32,
            ColorFormat::Jpeg => 2,
        };
        bytes.extend(color.to_le_bytes());
        bytes.extend(1i32.to_le_bytes());
        for side in [c.width, c.height, c.width, c.height] {
            bytes.extend(side.to_le_bytes());
        }
        bytes.extend(((1.0 / info.depth_unit_m) as f32).to_le_bytes());
        bytes.extend((info.frames as u64).to_le_bytes());
        self.append(&bytes)
    }

    fn deflated(&self, depth: &[u16]) -> Result<Vec<u8>, WriteError> {
        let failed = |e: std::io::Error| WriteError::Encode {
            file: self.name.clone(),
            reason: e.to_string(),
        };
        let raw: Vec<u8> = depth.iter().flat_map(|d| d.to_le_bytes()).collect();
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&raw).map_err(failed)?;
        encoder.finish().map_err(failed)
    }
}

impl<W: Write, F: FnMut(&str, &[u8]) -> std::io::Result<()>> RecordingWriter for SensWriter<W, F> {
    fn write(&mut self, frame: &Frame) -> Result<(), WriteError> {
        self.files.check(frame)?;
        if !self.begun {
            self.begun = true;
            self.begin()?;
        }
        let color = self.files.color(&self.name, &frame.color)?;
        let depth = self.deflated(&frame.depth)?;
        // -inf is how ScanNet says that there is no pose.
        let pose = frame.truth.map_or([f64::NEG_INFINITY; 16], |pose| pose.to_row_major());
        let mut header: Vec<u8> = pose.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect();
        let time_us = (frame.time_s * 1e6).round() as u64;
        for number in [time_us, time_us, color.len() as u64, depth.len() as u64] {
            header.extend(number.to_le_bytes());
        }
        self.append(&header)?;
        self.append(&color)?;
        self.append(&depth)?;
        self.files.put_labels(self.written, frame)?;
        self.written += 1;
        Ok(())
    }

    fn finish(mut self) -> Result<usize, WriteError> {
        let expected = self.files.info.frames;
        if self.written != expected {
            let (frame, field, found) = (self.written, "number of frames", self.written);
            return Err(WriteError::Frame { frame, field, found, expected });
        }
        // No records of an inertial sensor.
        self.append(&0u64.to_le_bytes())?;
        let failed = |source| WriteError::Sink { file: self.name.clone(), source };
        self.stream.flush().map_err(failed)?;
        self.files.put_lists()?;
        Ok(self.written)
    }
}
