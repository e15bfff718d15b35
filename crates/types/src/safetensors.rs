//! The safetensors format: the length of the header (u64, little endian), a JSON header that names
//! and describes the tensors, and their bytes, without gaps.
use alloc::{
    format,
    string::{String, ToString},
    vec::Vec,
};
use serde_json::{Map, Value};

/// Sizes of the numbers that the format knows \[bytes\].
const DTYPES: [(&str, usize); 12] = [
    ("F64", 8),
    ("F32", 4),
    ("F16", 2),
    ("BF16", 2),
    ("I64", 8),
    ("I32", 4),
    ("I16", 2),
    ("I8", 1),
    ("U64", 8),
    ("U32", 4),
    ("U16", 2),
    ("U8", 1),
];

/// A tensor in a file.
pub struct TensorView<'a> {
    /// Its name.
    pub name: String,
    /// One of the format's names, such as `F32`.
    pub dtype: String,
    /// Slowest dimension first.
    pub shape: Vec<usize>,
    /// As many as type and shape need.
    pub bytes: &'a [u8],
}

/// What a file holds.
pub struct File<'a> {
    /// The entry `__metadata__`.
    pub metadata: Option<Value>,
    /// In the order of their names.
    pub tensors: Vec<TensorView<'a>>,
}

/// What is not as it should be.
pub struct Malformed {
    /// Part of the file.
    pub field: String,
    /// What is there.
    pub found: String,
    /// What should be there.
    pub expected: String,
}

fn wrong(field: impl Into<String>, found: impl ToString, expected: impl ToString) -> Malformed {
    Malformed { field: field.into(), found: found.to_string(), expected: expected.to_string() }
}

/// Describes the tensors of a file. Memory stays in proportion to the header, which may have
/// `max_header_bytes`.
pub fn parse(bytes: &[u8], max_header_bytes: usize) -> Result<File<'_>, Malformed> {
    let Some((length, rest)) = bytes.split_first_chunk::<8>() else {
        let found = format!("{} bytes", bytes.len());
        return Err(wrong("file", found, "a header length of 8 bytes"));
    };
    let length = u64::from_le_bytes(*length);
    if length > max_header_bytes as u64 {
        let expected = format!("at most {max_header_bytes}");
        return Err(wrong("header", format!("a length of {length}"), expected));
    }
    if length > rest.len() as u64 {
        return Err(wrong("header", format!("{} bytes", rest.len()), length));
    }
    let (text, data) = rest.split_at(length as usize);
    let mut header: Map<String, Value> =
        serde_json::from_slice(text).map_err(|e| wrong("header", e, "JSON"))?;
    let metadata = header.remove("__metadata__");
    let mut tensors = Vec::with_capacity(header.len());
    let mut taken = 0;
    for (name, value) in header {
        let tensor = |part: &str| format!("tensor {name}: {part}");
        let field = |key: &str| {
            value.get(key).ok_or_else(|| wrong(tensor(key), "nothing", "an entry of the header"))
        };
        let named = field("dtype")?;
        let Some((dtype, size)) = DTYPES.iter().find(|(d, _)| named.as_str() == Some(d)) else {
            let known = DTYPES.map(|(d, _)| d).join(", ");
            return Err(wrong(tensor("dtype"), named, format!("one of {known}")));
        };
        let shape: Vec<usize> = serde_json::from_value(field("shape")?.clone())
            .map_err(|e| wrong(tensor("shape"), e, "whole numbers"))?;
        let [start, end]: [usize; 2] = serde_json::from_value(field("data_offsets")?.clone())
            .map_err(|e| wrong(tensor("data_offsets"), e, "two whole numbers"))?;
        let Some(bytes) = data.get(start..end) else {
            let found = format!("{} bytes of data; the file is cut off", data.len());
            return Err(wrong(tensor("data"), found, end));
        };
        let expected = shape.iter().try_fold(*size, |n, &d| n.checked_mul(d));
        if expected != Some(bytes.len()) {
            let found = format!("{} bytes", bytes.len());
            return Err(wrong(tensor("data"), found, format!("{size} x {shape:?}")));
        }
        // Ranges that overlap would multiply what a small file takes in memory.
        taken += bytes.len();
        if taken > data.len() {
            let found = format!("{taken} bytes of tensors in {} bytes", data.len());
            return Err(wrong(tensor("data_offsets"), found, "ranges that do not overlap"));
        }
        tensors.push(TensorView { name, dtype: (*dtype).to_string(), shape, bytes });
    }
    if taken != data.len() {
        let found = format!("{} bytes of data", data.len());
        return Err(wrong("file", found, format!("{taken}, those of the tensors")));
    }
    Ok(File { metadata, tensors })
}
