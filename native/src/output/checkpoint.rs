//! `checkpoint.safetensors`: the map in the safetensors format (8-byte header length, JSON header,
//! tensors). Written here rather than by a library because its header order must not depend on a
//! hash seed: the same run twice gives the same bytes.
use anyhow::{Context, Result, bail};
use mte_slam_core::slam::{Checkpoint, Dtype, Tensor};
use serde_json::{Map, Value, json};
use std::path::Path;

fn dtype_name(dtype: Dtype) -> &'static str {
    match dtype {
        Dtype::F32 => "F32",
        Dtype::U32 => "U32",
    }
}

/// The file's bytes.
pub fn write(checkpoint: &Checkpoint) -> Vec<u8> {
    // serde_json's map keeps keys sorted.
    let mut header = Map::new();
    header.insert("__metadata__".to_owned(), json!(checkpoint.metadata));
    let mut end = 0;
    for tensor in &checkpoint.tensors {
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
    for tensor in &checkpoint.tensors {
        bytes.extend_from_slice(&tensor.bytes);
    }
    bytes
}

/// Read `OUT/checkpoint.safetensors`.
pub fn read_file(path: &Path) -> Result<Checkpoint> {
    let bytes = std::fs::read(path).with_context(|| {
        format!("{}: cannot be read; is this the output folder of a finished run?", path.display())
    })?;
    read(&bytes).with_context(|| format!("{}: not a whole checkpoint", path.display()))
}

/// Parse and check a file's bytes.
pub fn read(bytes: &[u8]) -> Result<Checkpoint> {
    let Some((length, rest)) = bytes.split_first_chunk::<8>() else {
        bail!("found {} bytes, expected a header length of 8", bytes.len());
    };
    let length = u64::from_le_bytes(*length);
    if length > rest.len() as u64 {
        bail!("header: found {} bytes, expected {length}", rest.len());
    }
    let (text, data) = rest.split_at(length as usize);
    let header: Map<String, Value> =
        serde_json::from_slice(text).context("header: expected JSON")?;
    let mut checkpoint = Checkpoint::default();
    for (name, value) in header {
        if name == "__metadata__" {
            checkpoint.metadata =
                serde_json::from_value(value).context("metadata: expected texts")?;
            continue;
        }
        let field = |key: &str| {
            value.get(key).with_context(|| format!("tensor {name}: found no {key} in the header"))
        };
        let dtype = match field("dtype")?.as_str() {
            Some("F32") => Dtype::F32,
            Some("U32") => Dtype::U32,
            other => bail!("tensor {name}: dtype: found {other:?}, expected F32 or U32"),
        };
        let shape: Vec<usize> = serde_json::from_value(field("shape")?.clone())
            .with_context(|| format!("tensor {name}: shape: expected whole numbers"))?;
        let [start, end]: [usize; 2] = serde_json::from_value(field("data_offsets")?.clone())
            .with_context(|| format!("tensor {name}: data_offsets: expected two whole numbers"))?;
        let Some(bytes) = data.get(start..end) else {
            bail!(
                "tensor {name}: found {} bytes of data, expected {end}; the file is cut off",
                data.len()
            );
        };
        let expected = shape.iter().try_fold(4usize, |n, &d| n.checked_mul(d));
        if expected != Some(bytes.len()) {
            bail!("tensor {name}: found {} bytes, expected 4 x {shape:?}", bytes.len());
        }
        checkpoint.tensors.push(Tensor { name, dtype, shape, bytes: bytes.to_vec() });
    }
    Ok(checkpoint)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Checkpoint {
        let tensor = |name: &str, dtype, n: usize| Tensor {
            name: name.to_owned(),
            dtype,
            shape: vec![n, 2],
            bytes: (0..8 * n).map(|i| i as u8).collect(),
        };
        Checkpoint {
            tensors: vec![tensor("a", Dtype::F32, 3), tensor("b", Dtype::U32, 0)],
            metadata: [("k".to_owned(), "v \"quoted\"".to_owned())].into(),
        }
    }

    #[test]
    fn round_trip_and_every_cut_is_noticed() {
        let bytes = write(&sample());
        let back = read(&bytes).unwrap();
        assert_eq!(back.metadata, sample().metadata);
        assert_eq!(back.tensors[0].bytes, sample().tensors[0].bytes);
        assert_eq!(back.tensors[1].shape, [0, 2]);
        for cut in 0..bytes.len() {
            assert!(read(&bytes[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn another_reader_agrees() {
        let bytes = write(&sample());
        let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        let a = file.tensor("a").unwrap();
        assert_eq!(a.shape(), [3, 2]);
        assert_eq!(a.data(), &sample().tensors[0].bytes);
        assert_eq!(a.dtype(), safetensors::Dtype::F32);
    }
}
