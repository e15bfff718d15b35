//! Checkpoints as files in the safetensors format (8-byte header length, JSON header, tensors).
//! Written here rather than by a library because its header order must not depend on a hash seed:
//! the same run twice gives the same bytes.
use super::{Checkpoint, Dtype, SlamError, Tensor};
use alloc::{
    format,
    string::{String, ToString},
    vec::Vec,
};
use serde_json::{Map, Value, json};

fn dtype_name(dtype: Dtype) -> &'static str {
    match dtype {
        Dtype::F32 => "F32",
        Dtype::U32 => "U32",
    }
}

fn wrong(field: impl Into<String>, found: impl ToString, expected: impl ToString) -> SlamError {
    let (found, expected) = (found.to_string(), expected.to_string());
    SlamError::Checkpoint { field: field.into(), found, expected }
}

impl Checkpoint {
    /// The bytes of a safetensors file.
    pub fn to_bytes(&self) -> Vec<u8> {
        // serde_json's map keeps keys sorted.
        let mut header = Map::new();
        header.insert("__metadata__".to_string(), json!(self.metadata));
        let mut end = 0;
        for tensor in &self.tensors {
            let start = end;
            end += tensor.bytes.len();
            header.insert(
                tensor.name.clone(),
                json!({
                    "dtype": dtype_name(tensor.dtype),
                    "shape": tensor.shape,
                    "data_offsets": [start, end],
                }),
            );
        }
        let mut text = Value::Object(header).to_string().into_bytes();
        while !text.len().is_multiple_of(8) {
            text.push(b' ');
        }
        let mut bytes = Vec::with_capacity(8 + text.len() + end);
        bytes.extend_from_slice(&(text.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&text);
        for tensor in &self.tensors {
            bytes.extend_from_slice(&tensor.bytes);
        }
        bytes
    }

    /// Parses and checks a file's bytes.
    ///
    /// # Errors
    /// [`SlamError::Checkpoint`] with what is cut off or not as it should be.
    pub fn from_bytes(bytes: &[u8]) -> Result<Checkpoint, SlamError> {
        let Some((length, rest)) = bytes.split_first_chunk::<8>() else {
            let found = format!("{} bytes", bytes.len());
            return Err(wrong("file", found, "a header length of 8 bytes"));
        };
        let length = u64::from_le_bytes(*length);
        if length > rest.len() as u64 {
            let (found, expected) = (format!("{} bytes", rest.len()), format!("{length}"));
            return Err(wrong("header", found, expected));
        }
        let (text, data) = rest.split_at(length as usize);
        let header: Map<String, Value> =
            serde_json::from_slice(text).map_err(|e| wrong("header", e, "JSON"))?;
        let mut checkpoint = Checkpoint::default();
        for (name, value) in header {
            if name == "__metadata__" {
                checkpoint.metadata =
                    serde_json::from_value(value).map_err(|e| wrong("metadata", e, "texts"))?;
                continue;
            }
            let tensor = |part: &str| format!("tensor {name}: {part}");
            let field = |key: &str| {
                value
                    .get(key)
                    .ok_or_else(|| wrong(tensor(key), "nothing", "an entry of the header"))
            };
            let dtype = match field("dtype")?.as_str() {
                Some("F32") => Dtype::F32,
                Some("U32") => Dtype::U32,
                other => return Err(wrong(tensor("dtype"), format!("{other:?}"), "F32 or U32")),
            };
            let shape: Vec<usize> = serde_json::from_value(field("shape")?.clone())
                .map_err(|e| wrong(tensor("shape"), e, "whole numbers"))?;
            let [start, end]: [usize; 2] =
                serde_json::from_value(field("data_offsets")?.clone())
                    .map_err(|e| wrong(tensor("data_offsets"), e, "two whole numbers"))?;
            let Some(bytes) = data.get(start..end) else {
                let found = format!("{} bytes of data; the file is cut off", data.len());
                return Err(wrong(tensor("data"), found, format!("{end}")));
            };
            let expected = shape.iter().try_fold(4usize, |n, &d| n.checked_mul(d));
            if expected != Some(bytes.len()) {
                let (found, expected) =
                    (format!("{} bytes", bytes.len()), format!("4 x {shape:?}"));
                return Err(wrong(tensor("data"), found, expected));
            }
            checkpoint.tensors.push(Tensor { name, dtype, shape, bytes: bytes.to_vec() });
        }
        Ok(checkpoint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Checkpoint {
        let tensor = |name: &str, dtype, n: usize| Tensor {
            name: name.to_string(),
            dtype,
            shape: alloc::vec![n, 2],
            bytes: (0..8 * n).map(|i| i as u8).collect(),
        };
        Checkpoint {
            tensors: alloc::vec![tensor("a", Dtype::F32, 3), tensor("b", Dtype::U32, 0)],
            metadata: [("k".to_string(), "v \"quoted\"".to_string())].into(),
        }
    }

    #[test]
    fn round_trip_and_every_cut_is_noticed() {
        let bytes = sample().to_bytes();
        let back = Checkpoint::from_bytes(&bytes).unwrap();
        assert_eq!(back.metadata, sample().metadata);
        assert_eq!(back.tensors[0].bytes, sample().tensors[0].bytes);
        assert_eq!(back.tensors[1].shape, [0, 2]);
        for cut in 0..bytes.len() {
            assert!(Checkpoint::from_bytes(&bytes[..cut]).is_err(), "{cut}");
        }
    }
}
