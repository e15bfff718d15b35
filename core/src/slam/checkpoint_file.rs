//! Checkpoints as files in the safetensors format (8-byte header length, JSON header, tensors).
//! Written here rather than by a library because its header order must not depend on a hash seed:
//! the same run twice gives the same bytes.
use super::{Checkpoint, Dtype, SlamError, Tensor};
use crate::hash::Hasher;
use alloc::{
    borrow::Cow,
    format,
    string::{String, ToString},
    vec::Vec,
};
use mte_slam_types::safetensors;
use serde_json::{Map, Value, json};

impl Dtype {
    const ALL: [Dtype; 5] = [Dtype::F32, Dtype::F64, Dtype::U16, Dtype::U32, Dtype::U64];

    /// As the format names it.
    fn name(self) -> &'static str {
        match self {
            Dtype::F32 => "F32",
            Dtype::F64 => "F64",
            Dtype::U16 => "U16",
            Dtype::U32 => "U32",
            Dtype::U64 => "U64",
        }
    }
}

/// Longest header: the state of a run of a million frames, and more \[bytes\].
const MAX_HEADER_BYTES: usize = 256 << 20;
/// Metadata entry that holds the hash of everything else; only files have it.
const CHECKSUM: &str = "checksum";

fn wrong(field: impl Into<String>, found: impl ToString, expected: impl ToString) -> SlamError {
    let (found, expected) = (found.to_string(), expected.to_string());
    SlamError::Checkpoint { field: field.into(), found, expected }
}

impl Checkpoint {
    /// Tensors in the order of a file: larger numbers first, so that all are aligned.
    fn ordered(&self) -> Vec<&Tensor> {
        let mut all: Vec<&Tensor> = self.tensors.iter().collect();
        all.sort_by_key(|t| (core::cmp::Reverse(t.dtype.size()), &t.name));
        all
    }

    fn checksum(&self) -> String {
        let mut h = Hasher::default();
        for (key, value) in &self.metadata {
            h.bytes(key.as_bytes());
            h.bytes(value.as_bytes());
        }
        for t in self.ordered() {
            h.bytes(t.name.as_bytes());
            h.bytes(t.dtype.name().as_bytes());
            t.shape.iter().for_each(|d| h.word(*d as u64));
            h.bytes(&t.bytes);
        }
        format!("{:016x}", h.finish())
    }

    /// The bytes of a safetensors file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let parts = self.parts();
        let mut bytes = Vec::with_capacity(parts.iter().map(|p| p.len()).sum());
        parts.iter().for_each(|p| bytes.extend_from_slice(p));
        bytes
    }

    /// The same in pieces that follow each other, without another copy of the tensors.
    pub fn parts(&self) -> Vec<Cow<'_, [u8]>> {
        // serde_json's map keeps keys sorted.
        let mut header = Map::new();
        let mut metadata = self.metadata.clone();
        metadata.insert(CHECKSUM.to_string(), self.checksum());
        header.insert("__metadata__".to_string(), json!(metadata));
        let tensors = self.ordered();
        let mut end = 0;
        for tensor in &tensors {
            let start = end;
            end += tensor.bytes.len();
            header.insert(
                tensor.name.clone(),
                json!({
                    "dtype": tensor.dtype.name(),
                    "shape": tensor.shape,
                    "data_offsets": [start, end],
                }),
            );
        }
        let mut text = Value::Object(header).to_string().into_bytes();
        while !text.len().is_multiple_of(8) {
            text.push(b' ');
        }
        let length = (text.len() as u64).to_le_bytes().to_vec();
        let mut parts: Vec<Cow<'_, [u8]>> = [length, text].into_iter().map(Cow::Owned).collect();
        parts.extend(tensors.iter().map(|t| Cow::Borrowed(t.bytes.as_slice())));
        parts
    }

    /// Parses and checks a file's bytes.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] with what is cut off or not as it should be.
    pub fn from_bytes(bytes: &[u8]) -> Result<Checkpoint, SlamError> {
        let file = safetensors::parse(bytes, MAX_HEADER_BYTES)
            .map_err(|e| wrong(e.field, e.found, e.expected))?;
        let mut checkpoint = Checkpoint::default();
        if let Some(metadata) = file.metadata {
            checkpoint.metadata =
                serde_json::from_value(metadata).map_err(|e| wrong("metadata", e, "texts"))?;
        }
        for safetensors::TensorView { name, dtype: named, shape, bytes } in file.tensors {
            let Some(dtype) = Dtype::ALL.into_iter().find(|d| named == d.name()) else {
                let field = format!("tensor {name}: dtype");
                return Err(wrong(field, named, "F32, F64, U16, U32 or U64"));
            };
            checkpoint.tensors.push(Tensor { name, dtype, shape, bytes: bytes.to_vec() });
        }
        if let Some(expected) = checkpoint.metadata.remove(CHECKSUM) {
            let found = checkpoint.checksum();
            if found != expected {
                return Err(wrong(CHECKSUM, format!("{found}; the file is damaged"), expected));
            }
        }
        Ok(checkpoint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Checkpoint {
        let tensor = |name: &str, dtype: Dtype, n: usize| Tensor {
            name: name.to_string(),
            dtype,
            shape: alloc::vec![n, 2],
            bytes: (0..2 * n * dtype.size()).map(|i| i as u8).collect(),
        };
        Checkpoint {
            tensors: alloc::vec![
                tensor("a", Dtype::F32, 3),
                tensor("b", Dtype::U32, 0),
                tensor("c", Dtype::U16, 1),
                tensor("d", Dtype::F64, 2),
            ],
            metadata: [("k".to_string(), "v \"quoted\"".to_string())].into(),
        }
    }

    #[test]
    fn round_trip_and_every_cut_and_flipped_bit_is_noticed() {
        let bytes = sample().to_bytes();
        let back = Checkpoint::from_bytes(&bytes).unwrap();
        assert_eq!(back.metadata, sample().metadata);
        assert_eq!(back.tensors[0].bytes, sample().tensors[0].bytes);
        assert_eq!(back.tensors[1].shape, [0, 2]);
        assert_eq!(back.to_bytes(), bytes);
        for cut in 0..bytes.len() {
            assert!(Checkpoint::from_bytes(&bytes[..cut]).is_err(), "{cut}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(Checkpoint::from_bytes(&longer).is_err());
        for bit in 0..8 * bytes.len() {
            let mut other = bytes.clone();
            other[bit / 8] ^= 1 << (bit % 8);
            // Nothing but blanks may go unnoticed, and the name of the checksum itself.
            if let Ok(read) = Checkpoint::from_bytes(&other) {
                assert!(read == back || read.metadata.len() == 2, "bit {bit}");
            }
        }
    }

    #[test]
    fn ranges_that_overlap_are_refused() {
        let header = r#"{"a":{"dtype":"U16","shape":[2],"data_offsets":[0,4]},"b":{"dtype":"U16","shape":[2],"data_offsets":[0,4]}}"#;
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend_from_slice(header.as_bytes());
        bytes.extend_from_slice(&[0; 4]);
        let message = Checkpoint::from_bytes(&bytes).unwrap_err().to_string();
        assert!(message.contains("overlap"), "{message}");
    }
}
