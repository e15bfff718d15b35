//! Feature maps in NumPy's format.
use super::place::Place;
use mte_slam_types::{frame::FeatureMap, sequence::SequenceError};

/// Longest header: it describes one array \[bytes\].
const MAX_HEADER_BYTES: usize = 65535;

/// Reads a NumPy file (versions 1 to 3) of float32 or float16, little endian, C order, C x h x w.
pub(super) fn parse(bytes: &[u8], at: Place<'_>) -> Result<FeatureMap, SequenceError> {
    let wrong = |field: &str, found: String, expected: &str| at.wrong(field, found, expected);
    let Some(rest) = bytes.strip_prefix(b"\x93NUMPY") else {
        return wrong("feature map", format!("{} bytes of no NumPy file", bytes.len()), "a .npy");
    };
    let (length, start) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 4),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 6),
        [1..=3, ..] | [] => {
            return wrong("feature map", "a file that ends early".into(), "a whole .npy file");
        }
        [version, ..] => return wrong("NumPy version", version.to_string(), "1, 2 or 3"),
    };
    if length > MAX_HEADER_BYTES {
        let found = format!("a length of {length}");
        return wrong("NumPy header", found, "at most 65535 bytes");
    }
    let Some(header) = rest.get(start..).and_then(|r| r.get(..length)) else {
        return wrong("NumPy header", "a file that ends early".into(), "a whole header");
    };
    let header = String::from_utf8_lossy(header);
    let entry = |key: &str| {
        let (_, after) = header.split_once(&format!("'{key}':"))?;
        Some(after.trim_start())
    };
    let dtype = entry("descr").and_then(|e| e.strip_prefix('\'')?.split_once('\'')).map(|e| e.0);
    let size = match dtype {
        Some("<f4") => 4,
        Some("<f2") => 2,
        other => {
            let found = other.map_or("none".into(), |o| o.chars().take(40).collect());
            return wrong("dtype of the feature map", found, "<f4 (float32) or <f2 (float16)");
        }
    };
    if !entry("fortran_order").is_some_and(|e| e.starts_with("False")) {
        let expected = "C order (numpy.ascontiguousarray)";
        return wrong("order of the feature map", "Fortran order".into(), expected);
    }
    let shape = entry("shape").and_then(|e| e.strip_prefix('(')?.split_once(')')).map(|e| e.0);
    let shape = shape.unwrap_or_default();
    let sizes = shape.split(',').map(str::trim).filter(|n| !n.is_empty());
    // What is no number is no size either.
    let sizes: Vec<usize> = sizes.map(|n| n.parse().unwrap_or(0)).collect();
    let shown: String = shape.chars().take(40).collect();
    at.map(&sizes, &format!("({shown})"), size, &rest[start + length..])
}
