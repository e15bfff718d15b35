//! Decoded frames over a connection, as `mte-slam serve` sends them and a page receives them.
//!
//! First comes a description of the recording ([`StreamInfo`], JSON); then, over a connection of its
//! own, one frame after the other: length of the header (u32, little endian), the header (JSON:
//! `version`, `index`, `number`, `time_s`, `labels`), colour (RGB, 3 bytes per pixel), depth (u16,
//! little endian) and, with labels, compact classes (1 byte per pixel). Where a frame cannot be read, a
//! header with `version` and `error` ends the stream.
//!
//! The description and every header name the version of this format; readers refuse another one.
use mte_slam_types::{
    camera::Camera,
    classes::{ClassTable, UNLABELLED},
    frame::{Bounds, Frame, SequenceInfo},
    pose::Pose,
    sequence::Sequence,
};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Version of the format; it rises with every change that readers have to know of.
pub const VERSION: u32 = 1;
/// A longer header is none \[bytes\].
const MAX_HEADER_BYTES: usize = 1 << 16;
/// Larger images are none.
const MAX_PIXELS: usize = 1 << 26;
/// Bytes of the header's length.
const LENGTH_BYTES: usize = 4;

/// Why a stream cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StreamError {
    /// Sender and receiver are of different builds.
    #[error(
        "version of the stream: found {}, expected {expected}; use the page and the program of one \
         build",
        Found(*.found)
    )]
    Version {
        /// What the sender names; `None` where it names none.
        found: Option<u32>,
        /// [`VERSION`].
        expected: u32,
    },
    /// Bytes that are not what the format says.
    #[error("{part}: found {found}, expected {expected}")]
    Invalid {
        /// Part of the stream.
        part: &'static str,
        /// What was there.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// The bytes end inside a frame.
    #[error("the stream ended inside a frame: found {found} bytes of it, expected {expected}")]
    Truncated {
        /// Bytes of the frame.
        found: usize,
        /// Bytes that the frame has at least.
        expected: usize,
    },
    /// The sender could not read the frame, for this reason.
    #[error("{0}")]
    Unreadable(String),
}

struct Found(Option<u32>);

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(version) => write!(f, "{version}"),
            None => f.write_str("none"),
        }
    }
}

/// What every JSON text of the stream begins with, whatever its version.
#[derive(Deserialize)]
struct Versioned {
    version: Option<u32>,
}

/// Reads a JSON text of this version.
fn read<'a, T: Deserialize<'a>>(part: &'static str, bytes: &'a [u8]) -> Result<T, StreamError> {
    let invalid = |e: serde_json::Error| StreamError::Invalid {
        part,
        found: e.to_string(),
        expected: "JSON as `mte-slam serve` sends it",
    };
    let Versioned { version } = serde_json::from_slice(bytes).map_err(invalid)?;
    if version != Some(VERSION) {
        return Err(StreamError::Version { found: version, expected: VERSION });
    }
    serde_json::from_slice(bytes).map_err(invalid)
}

/// What a recording is, before its frames.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StreamInfo {
    /// [`VERSION`].
    pub version: u32,
    /// Name for people.
    pub name: String,
    /// Layout of the files.
    pub layout: String,
    /// Camera of the images.
    pub camera: Camera,
    /// Metres per unit of depth.
    pub depth_unit_m: f64,
    /// Number of frames.
    pub frames: usize,
    /// Classes of the labels; empty without labels.
    pub classes: ClassTable,
    /// Scene bounds in the world frame of the true poses, where known \[m\].
    pub bounds: Option<Bounds>,
    /// What was assumed, skipped or masked while opening.
    pub warnings: Vec<String>,
    /// True `world_from_camera` of each frame, row by row, where known.
    pub truth: Vec<Option<[f64; 16]>>,
}

impl StreamInfo {
    /// Of a sequence.
    pub fn of(sequence: &dyn Sequence) -> StreamInfo {
        let info = sequence.info();
        StreamInfo {
            version: VERSION,
            name: info.name.clone(),
            layout: info.layout.to_owned(),
            camera: info.camera,
            depth_unit_m: info.depth_unit_m,
            frames: info.frames,
            classes: info.classes.clone(),
            bounds: info.bounds,
            warnings: sequence.warnings(),
            truth: (0..info.frames).map(|i| sequence.truth(i).map(|p| p.to_row_major())).collect(),
        }
    }

    /// As JSON.
    ///
    /// # Errors
    /// [`StreamError::Invalid`] where a value has no JSON form.
    pub fn to_json(&self) -> Result<Vec<u8>, StreamError> {
        serde_json::to_vec(self).map_err(|e| StreamError::Invalid {
            part: "description of the recording",
            found: e.to_string(),
            expected: "values that JSON can hold",
        })
    }

    /// From JSON.
    ///
    /// # Errors
    /// [`StreamError::Version`] for another version, [`StreamError::Invalid`] for anything else that
    /// is not the description of a recording.
    pub fn from_json(bytes: &[u8]) -> Result<StreamInfo, StreamError> {
        let info: StreamInfo = read("description of the recording", bytes)?;
        let pixels = info.camera.pixels();
        if pixels == 0 || pixels > MAX_PIXELS || info.classes.len() > usize::from(UNLABELLED) {
            return Err(StreamError::Invalid {
                part: "description of the recording",
                found: format!("{:?}, {} classes", info.camera, info.classes.len()),
                expected: "a camera with pixels, and at most 255 classes",
            });
        }
        Ok(info)
    }

    /// The frames' sequence, whose layout is `stream`; feature maps are not sent.
    pub fn sequence_info(&self) -> SequenceInfo {
        SequenceInfo {
            feature_channels: 0,
            name: self.name.clone(),
            layout: "stream",
            camera: self.camera,
            depth_unit_m: self.depth_unit_m,
            frames: self.frames,
            classes: self.classes.clone(),
            bounds: self.bounds,
        }
    }

    /// The true poses; those that are no rigid motion are left out.
    pub fn true_poses(&self) -> Vec<Option<Pose>> {
        self.truth.iter().map(|p| p.as_ref().and_then(Pose::from_row_major)).collect()
    }
}

/// Before the images of a frame.
#[derive(Serialize, Deserialize)]
struct Header {
    version: u32,
    index: usize,
    number: u64,
    time_s: f64,
    labels: bool,
}

/// In place of a frame.
#[derive(Serialize, Deserialize)]
struct Failure {
    version: u32,
    error: String,
}

/// A header of either kind.
#[derive(Deserialize)]
struct AnyHeader {
    error: Option<String>,
}

fn write_header(header: &impl Serialize, bytes: &mut Vec<u8>) {
    // Numbers, a flag and a text always have a JSON form.
    let text = serde_json::to_vec(header).unwrap_or_default();
    bytes.extend_from_slice(&(text.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&text);
}

/// Appends a frame.
pub fn write_frame(frame: &Frame, bytes: &mut Vec<u8>) {
    let header = Header {
        version: VERSION,
        index: frame.index,
        number: frame.number,
        time_s: frame.time_s,
        labels: frame.labels.is_some(),
    };
    write_header(&header, bytes);
    bytes.extend_from_slice(frame.color.as_flattened());
    bytes.extend(frame.depth.iter().flat_map(|d| d.to_le_bytes()));
    bytes.extend(frame.labels.iter().flatten());
}

/// Appends why there is no further frame.
pub fn write_failure(error: String, bytes: &mut Vec<u8>) {
    write_header(&Failure { version: VERSION, error }, bytes);
}

/// Makes frames of bytes that arrive in any pieces.
#[derive(Debug)]
pub struct FrameDecoder {
    pixels: usize,
    /// Bytes from the start of the next frame on.
    waiting: Vec<u8>,
}

impl FrameDecoder {
    /// For images of `pixels` pixels, from the start of a frame.
    pub fn new(pixels: usize) -> FrameDecoder {
        FrameDecoder { pixels, waiting: Vec::new() }
    }

    /// Takes bytes that have arrived.
    pub fn push(&mut self, bytes: &[u8]) {
        self.waiting.extend_from_slice(bytes);
    }

    /// The next frame, without its true pose; `None` until all its bytes have arrived.
    ///
    /// # Errors
    /// [`StreamError::Version`] and [`StreamError::Invalid`] as soon as the header says so;
    /// [`StreamError::Unreadable`] in place of a frame that the sender could not read.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, StreamError> {
        let Some((header, start)) = self.header()? else { return Ok(None) };
        let end = start + self.image_bytes(header.labels);
        if self.waiting.len() < end {
            return Ok(None);
        }
        let rest = self.waiting.split_off(end);
        let whole = std::mem::replace(&mut self.waiting, rest);
        let (color, others) = whole[start..].split_at(3 * self.pixels);
        let (depth, labels) = others.split_at(2 * self.pixels);
        Ok(Some(Frame {
            features: None,
            index: header.index,
            number: header.number,
            time_s: header.time_s,
            color: color.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            depth: depth.chunks_exact(2).map(|d| u16::from_le_bytes([d[0], d[1]])).collect(),
            labels: header.labels.then(|| labels.to_vec()),
            truth: None,
        }))
    }

    /// Says that no further bytes will come.
    ///
    /// # Errors
    /// [`StreamError::Truncated`] inside a frame.
    pub fn finish(&self) -> Result<(), StreamError> {
        let found = self.waiting.len();
        if found == 0 {
            return Ok(());
        }
        let expected = match self.header()? {
            Some((header, start)) => start + self.image_bytes(header.labels),
            None => LENGTH_BYTES + self.length().unwrap_or(1),
        };
        if found < expected { Err(StreamError::Truncated { found, expected }) } else { Ok(()) }
    }

    fn image_bytes(&self, labels: bool) -> usize {
        (5 + usize::from(labels)) * self.pixels
    }

    /// Length of the next header, if it has arrived \[bytes\].
    fn length(&self) -> Option<usize> {
        let length = self.waiting.first_chunk::<LENGTH_BYTES>()?;
        Some(u32::from_le_bytes(*length) as usize)
    }

    /// The next header, if it has arrived, and where its images start.
    fn header(&self) -> Result<Option<(Header, usize)>, StreamError> {
        const PART: &str = "header of a frame";
        let Some(length) = self.length() else { return Ok(None) };
        if length > MAX_HEADER_BYTES {
            let found = format!("{length} bytes");
            return Err(StreamError::Invalid { part: PART, found, expected: "at most 65536" });
        }
        let start = LENGTH_BYTES + length;
        let Some(text) = self.waiting.get(LENGTH_BYTES..start) else { return Ok(None) };
        if let AnyHeader { error: Some(error) } = read(PART, text)? {
            return Err(StreamError::Unreadable(error));
        }
        Ok(Some((read(PART, text)?, start)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_synth::{SyntheticOptions, SyntheticSequence};

    fn sequence() -> SyntheticSequence {
        SyntheticSequence::new(SyntheticOptions { frames: 3, ..SyntheticOptions::tiny() })
    }

    fn changed(json: &[u8], change: impl Fn(&mut serde_json::Value)) -> Vec<u8> {
        let mut value = serde_json::from_slice(json).unwrap();
        change(&mut value);
        serde_json::to_vec(&value).unwrap()
    }

    #[test]
    fn a_description_reads_back_and_names_its_version() {
        let sequence = sequence();
        let sent = StreamInfo::of(&sequence);
        let json = sent.to_json().unwrap();
        let read = StreamInfo::from_json(&json).unwrap();
        let (a, b) = (sequence.info(), read.sequence_info());
        assert_eq!((&a.name, a.camera, a.frames), (&b.name, b.camera, b.frames));
        assert_eq!((a.depth_unit_m, &a.classes, b.layout), (b.depth_unit_m, &b.classes, "stream"));
        assert_eq!(read.truth, sent.truth);
        for (i, pose) in read.true_poses().iter().enumerate() {
            // Poses are made rigid again as they are read, which rounds.
            let moved = pose.unwrap().compose(&sequence.truth(i).unwrap().inverse());
            assert!(moved.translation.length() < 1e-12 && moved.angle_rad() < 1e-7, "frame {i}");
        }
        let other = changed(&json, |v| v["version"] = 2.into());
        let error = StreamInfo::from_json(&other).unwrap_err();
        assert_eq!(error, StreamError::Version { found: Some(2), expected: VERSION });
        assert!(error.to_string().contains("found 2, expected 1"), "{error}");
        // What was sent before there were versions.
        let before = changed(&json, |v| drop(v.as_object_mut().unwrap().remove("version")));
        let error = StreamInfo::from_json(&before).unwrap_err();
        assert_eq!(error, StreamError::Version { found: None, expected: VERSION });
        for bad in [b"{".to_vec(), changed(&json, |v| v["camera"]["width"] = 0.into())] {
            let error = StreamInfo::from_json(&bad).unwrap_err();
            assert!(matches!(error, StreamError::Invalid { .. }), "{error}");
        }
    }

    #[test]
    fn frames_read_back_from_pieces_of_any_size() {
        let mut sequence = sequence();
        let mut frames: Vec<Frame> = (0..3).map(|i| sequence.frame(i).unwrap()).collect();
        frames[1].labels = None;
        let mut bytes = Vec::new();
        frames.iter().for_each(|f| write_frame(f, &mut bytes));
        for size in [1, 1000, bytes.len()] {
            let mut decoder = FrameDecoder::new(sequence.info().camera.pixels());
            let mut read = Vec::new();
            for piece in bytes.chunks(size) {
                decoder.push(piece);
                while let Some(frame) = decoder.next_frame().unwrap() {
                    read.push(frame);
                }
            }
            decoder.finish().unwrap();
            assert_eq!(read.len(), frames.len(), "pieces of {size}");
            for (a, b) in read.iter().zip(&frames) {
                assert_eq!((a.index, a.number, a.time_s), (b.index, b.number, b.time_s));
                assert!(a.color == b.color && a.depth == b.depth && a.labels == b.labels);
            }
        }
    }

    #[test]
    fn truncated_streams_say_how_much_is_missing() {
        let mut sequence = sequence();
        let pixels = sequence.info().camera.pixels();
        let mut bytes = Vec::new();
        write_frame(&sequence.frame(0).unwrap(), &mut bytes);
        let header = bytes.len() - 6 * pixels;
        for (found, expected) in
            [(1, 5), (4, header), (header, bytes.len()), (bytes.len() - 1, bytes.len())]
        {
            let mut decoder = FrameDecoder::new(pixels);
            decoder.push(&bytes[..found]);
            assert!(decoder.next_frame().unwrap().is_none());
            let error = decoder.finish().unwrap_err();
            assert_eq!(error, StreamError::Truncated { found, expected });
        }
    }

    #[test]
    fn other_versions_failures_and_nonsense_are_told_apart() {
        let with = |header: &str| {
            let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
            bytes.extend_from_slice(header.as_bytes());
            let mut decoder = FrameDecoder::new(4);
            decoder.push(&bytes);
            decoder.next_frame().unwrap_err()
        };
        let header = r#"{"index":0,"number":0,"time_s":0.0,"labels":false"#;
        let expected = VERSION;
        let error = with(&format!("{header}}}"));
        assert_eq!(error, StreamError::Version { found: None, expected });
        let error = with(&format!("{header},\"version\":9}}"));
        assert_eq!(error, StreamError::Version { found: Some(9), expected });
        for text in ["[]", "{\"version\":1}", "{\"version\":1,\"index\":-1}"] {
            assert!(matches!(with(text), StreamError::Invalid { .. }), "{text}");
        }
        let mut bytes = Vec::new();
        write_failure("rgb/3.png: cannot be read".to_owned(), &mut bytes);
        let mut decoder = FrameDecoder::new(4);
        decoder.push(&bytes);
        let error = decoder.next_frame().unwrap_err();
        assert_eq!(error, StreamError::Unreadable("rgb/3.png: cannot be read".to_owned()));
        let mut decoder = FrameDecoder::new(4);
        decoder.push(&u32::MAX.to_le_bytes());
        assert!(matches!(decoder.next_frame().unwrap_err(), StreamError::Invalid { .. }));
    }
}
