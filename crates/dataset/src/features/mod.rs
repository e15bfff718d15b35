//! Feature maps that a model made elsewhere: one NumPy or safetensors file a frame, C x h x w.
mod npy;
mod safetensors;

use super::{
    entries::Entry,
    folder::{Folder, invalid, plural},
};
use mte_slam_types::{
    frame::{FeatureMap, MAX_FEATURE_CHANNELS},
    sequence::SequenceError,
};
use std::collections::BTreeMap;

/// Longest side of a feature map.
const MAX_FEATURE_SIDE: usize = 4096;
/// What the files' names end in.
const ENDS: [&str; 2] = [".npy", safetensors::END];

/// The feature maps of a recording's frames.
pub(super) struct Features {
    folder: Folder,
    /// By frame number.
    files: BTreeMap<u64, String>,
    /// The same for all frames.
    pub channels: usize,
    /// The file that said so.
    first: String,
}

impl Features {
    /// Finds `000000.npy` or `000000.safetensors`, ... for every frame, and how many channels
    /// they have.
    pub fn open(mut folder: Folder, frames: &[Entry]) -> Result<Self, SequenceError> {
        let mut files = folder.numbered("", &ENDS)?;
        while files.is_empty() && folder.descend() {
            files = folder.numbered("", &ENDS)?;
        }
        if files.is_empty() {
            let found = plural(folder.names().count(), "file");
            let expected = "NumPy or safetensors files named by frame number, such as 000000.npy \
                            or 000000.safetensors";
            return Err(invalid(&folder.name(), None, "feature maps", found, expected));
        }
        let mut features = Features { folder, files, channels: 0, first: String::new() };
        for frame in frames {
            features.file(frame.number)?;
        }
        if let Some(frame) = frames.first() {
            let map = features.read(frame.number)?;
            features.channels = map.channels;
            features.first = features.files[&frame.number].clone();
        }
        Ok(features)
    }

    /// The file of a frame.
    fn file(&self, frame: u64) -> Result<&str, SequenceError> {
        self.files.get(&frame).map(String::as_str).ok_or_else(|| {
            // Named as its neighbours are.
            let end =
                self.files.values().next().and_then(|f| ENDS.iter().find(|e| f.ends_with(**e)));
            let file = format!("{frame:06}{}", end.unwrap_or(&ENDS[0]));
            let reason = format!("no such file in {} (frame {frame})", self.folder.name());
            SequenceError::Read { file, reason }
        })
    }

    /// The feature map of a frame.
    pub fn read(&self, frame: u64) -> Result<FeatureMap, SequenceError> {
        let file = self.file(frame)?;
        let map = parse(&self.folder.read(file)?, file, frame)?;
        if self.channels > 0 && map.channels != self.channels {
            let expected = format!("{} as in {}", self.channels, self.first);
            let field = "channels of the feature map";
            return Err(invalid(file, Some(frame), field, map.channels.to_string(), expected));
        }
        Ok(map)
    }
}

/// A feature map in the format that the file's name says.
pub(super) fn parse(bytes: &[u8], file: &str, frame: u64) -> Result<FeatureMap, SequenceError> {
    let at = Place { file, frame };
    match file.ends_with(safetensors::END) {
        true => safetensors::parse(bytes, at),
        false => npy::parse(bytes, at),
    }
}

/// The file and frame that messages are about.
#[derive(Clone, Copy)]
struct Place<'a> {
    file: &'a str,
    frame: u64,
}

impl Place<'_> {
    fn wrong<T>(
        self,
        field: &str,
        found: impl ToString,
        expected: &str,
    ) -> Result<T, SequenceError> {
        Err(invalid(self.file, Some(self.frame), field, found.to_string(), expected))
    }

    /// The map of little-endian floats of `float_bytes` bytes (4 or 2) in C order, after the sizes
    /// that the file gives, which are checked; `shown` is how it puts them.
    fn map(
        self,
        sizes: &[usize],
        shown: &str,
        float_bytes: usize,
        data: &[u8],
    ) -> Result<FeatureMap, SequenceError> {
        let field = "shape of the feature map";
        let &[channels, height, width] = sizes else {
            return self.wrong(field, shown, "(channels, height, width)");
        };
        if sizes.contains(&0) {
            return self.wrong(field, shown, "(channels, height, width), none of them 0");
        }
        if channels > MAX_FEATURE_CHANNELS || height > MAX_FEATURE_SIDE || width > MAX_FEATURE_SIDE
        {
            return self.wrong(field, shown, "3 sizes, none of them over 4096");
        }
        // Up to 2^38: more than a 32-bit number holds.
        let expected = (channels * height) as u64 * width as u64 * float_bytes as u64;
        if data.len() as u64 != expected {
            let expected = format!("{expected} for the shape {shown}");
            return self.wrong("bytes of the feature map", data.len(), &expected);
        }
        let values: Vec<f32> = if float_bytes == 4 {
            data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
        } else {
            data.as_chunks().0.iter().map(|b| half(u16::from_le_bytes(*b))).collect()
        };
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            let at = format!("{} at index {i}", values[i]);
            return self.wrong("values of the feature map", at, "finite numbers");
        }
        Ok(FeatureMap { channels, height, width, values })
    }
}

/// A 16-bit float's value.
fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 != 0 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    sign * match exponent {
        0 => fraction * 2.0_f32.powi(-14),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + fraction) * 2.0_f32.powi(exponent - 15),
    }
}

#[cfg(test)]
pub(super) mod tests;
