//! Decoders one by one, for the fuzz targets alone: readers call them on whole recordings only.
use super::{
    decode::{self, Origin},
    features,
};
use mte_slam_types::{frame::FeatureMap, sequence::SequenceError};

fn origin(what: &'static str) -> Origin<'static> {
    Origin { file: "file", frame: 0, what }
}

/// The size of an image by its header, and its pixels as each kind of image; what fails is `None`.
#[derive(Debug)]
pub struct Decoded {
    /// Width and height \[pixels\].
    pub size: Option<(u32, u32)>,
    /// Pixels of a colour image.
    pub color: Option<usize>,
    /// Pixels of a depth image.
    pub depth: Option<usize>,
    /// Pixels of a label image, and its size.
    pub labels: Option<(usize, (u32, u32))>,
}

/// Decodes an image in every way there is.
pub fn decode_image(bytes: &[u8]) -> Decoded {
    Decoded {
        size: decode::size_of(bytes, origin("image")).ok(),
        color: decode::color(bytes, origin("colour image"), None).ok().map(|p| p.len()),
        depth: decode::depth(bytes, origin("depth image"), None).ok().map(|p| p.len()),
        labels: decode::labels(bytes, origin("label image")).ok().map(|(p, size)| (p.len(), size)),
    }
}

/// Parses a feature map; the ending of `file` says in which format.
///
/// # Errors
/// As the reader of feature maps.
pub fn parse_features(file: &str, bytes: &[u8]) -> Result<FeatureMap, SequenceError> {
    features::parse(bytes, file, 0)
}
