//! Feature maps that a model made elsewhere: one NumPy or safetensors file per frame, C x h x w.
mod npy;
mod place;
mod safetensors;

use super::{
    entries::Entry,
    folder::{Folder, invalid, plural},
};
use mte_slam_types::{frame::FeatureMap, sequence::SequenceError};
use place::Place;
use std::collections::BTreeMap;

/// What the files' names end in.
const ENDS: [&str; 2] = [".npy", safetensors::END];

/// The feature maps of a recording's frames.
pub(super) struct FeatureFiles {
    folder: Folder,
    /// By frame number.
    files: BTreeMap<u64, String>,
    /// The same for all frames.
    pub channels: usize,
    /// The file that said so.
    first: String,
}

impl FeatureFiles {
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
        let mut features = FeatureFiles { folder, files, channels: 0, first: String::new() };
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

    /// Returns the file of a frame.
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

    /// Returns the feature map of a frame.
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

/// Returns a feature map in the format that the file's name says.
pub(super) fn parse(bytes: &[u8], file: &str, frame: u64) -> Result<FeatureMap, SequenceError> {
    let at = Place { file, frame };
    match file.ends_with(safetensors::END) {
        true => safetensors::parse(bytes, at),
        false => npy::parse(bytes, at),
    }
}

#[cfg(test)]
pub(super) mod tests;
