//! Where an image lies: a file of its own, or a part of a file that holds many.
use super::{
    decode::{self, Origin, Size},
    folder::Folder,
};
use mte_slam_types::sequence::SequenceError;
use std::io::Read;

/// The place of an image.
#[derive(Clone, Debug)]
pub(super) struct Stored {
    pub file: String,
    /// Which part of the file; all of it where `None`.
    pub part: Option<Part>,
}

/// A part of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub offset: u64,
    pub bytes: usize,
    pub coding: Coding,
    /// The size that the file says all its images have.
    pub size: Size,
}

/// What the bytes of a part are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coding {
    /// A PNG or JPEG.
    Image,
    /// Red, green and blue of each pixel.
    RawColor,
    /// A little-endian u16 per pixel.
    RawDepth,
    /// The same, compressed by zlib.
    ZlibDepth,
}

impl From<String> for Stored {
    fn from(file: String) -> Self {
        Stored { file, part: None }
    }
}

impl Stored {
    fn read(&self, folder: &Folder) -> Result<Vec<u8>, SequenceError> {
        match self.part {
            None => folder.read(&self.file),
            Some(part) => folder.read_range(&self.file, part.offset, part.bytes),
        }
    }

    fn origin(&self, frame: u64, what: &'static str) -> Origin<'_> {
        Origin { file: &self.file, frame, what }
    }

    /// Returns the size, from the header of the image.
    pub fn size(
        &self,
        folder: &Folder,
        frame: u64,
        what: &'static str,
    ) -> Result<Size, SequenceError> {
        let origin = self.origin(frame, what);
        match self.part {
            Some(part) => {
                origin.check_size(part.size, None)?;
                Ok(part.size)
            }
            None => decode::size_of(&self.read(folder)?, origin),
        }
    }

    /// Decodes a colour image of a known size.
    pub fn color(
        &self,
        folder: &Folder,
        frame: u64,
        size: Size,
    ) -> Result<Vec<[u8; 3]>, SequenceError> {
        let origin = self.origin(frame, "colour image");
        let bytes = self.read(folder)?;
        match self.part.map(|p| p.coding) {
            Some(Coding::RawColor) => {
                check_length(origin, &bytes, size, 3)?;
                Ok(bytes.as_chunks::<3>().0.to_vec())
            }
            _ => decode::color(&bytes, origin, Some(size)),
        }
    }

    /// Decodes a depth image of a known size.
    pub fn depth(
        &self,
        folder: &Folder,
        frame: u64,
        size: Size,
    ) -> Result<Vec<u16>, SequenceError> {
        let origin = self.origin(frame, "depth image");
        let mut bytes = self.read(folder)?;
        match self.part.map(|p| p.coding) {
            Some(Coding::RawDepth) => {}
            Some(Coding::ZlibDepth) => bytes = inflated(origin, &bytes, size)?,
            _ => return decode::depth(&bytes, origin, Some(size)),
        }
        check_length(origin, &bytes, size, 2)?;
        Ok(bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect())
    }
}

/// Unpacks no more than one byte over what an image of that size has: a few bytes can claim to
/// hold gigabytes.
fn inflated(origin: Origin<'_>, bytes: &[u8], size: Size) -> Result<Vec<u8>, SequenceError> {
    let wanted = size.0 as usize * size.1 as usize * 2;
    let mut out = Vec::with_capacity(wanted.min(bytes.len().saturating_mul(1100)));
    let mut stream = flate2::read::ZlibDecoder::new(bytes).take(wanted as u64 + 1);
    match stream.read_to_end(&mut out) {
        Ok(_) => Ok(out),
        Err(e) => Err(origin.error(
            format!("a broken zlib stream of {} bytes ({e})", bytes.len()),
            format!("{wanted} bytes of depth, compressed by zlib"),
        )),
    }
}

fn check_length(
    origin: Origin<'_>,
    bytes: &[u8],
    size: Size,
    each: usize,
) -> Result<(), SequenceError> {
    let wanted = size.0 as usize * size.1 as usize * each;
    if bytes.len() == wanted {
        return Ok(());
    }
    let found = match bytes.len() > wanted && each == 2 {
        true => "more".into(),
        false => format!("{} bytes", bytes.len()),
    };
    Err(origin.error(found, format!("{wanted} bytes, {each} for each of {}x{}", size.0, size.1)))
}
