//! Feature maps that a model made elsewhere: one NumPy file a frame, C x h x w.
use super::{
    entries::Entry,
    folder::{Folder, invalid, plural},
};
use crate::{
    frame::{FeatureMap, MAX_FEATURE_CHANNELS},
    sequence::SequenceError,
};
use std::collections::BTreeMap;

/// Longest side of a feature map.
const MAX_FEATURE_SIDE: usize = 4096;

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
    /// Finds `000000.npy`, ... for every frame, and how many channels they have.
    pub fn open(mut folder: Folder, frames: &[Entry]) -> Result<Self, SequenceError> {
        let mut files = folder.numbered("", &[".npy"])?;
        while files.is_empty() && folder.descend() {
            files = folder.numbered("", &[".npy"])?;
        }
        if files.is_empty() {
            let found = plural(folder.names().count(), "file");
            let expected = "NumPy files named by frame number, such as 000000.npy";
            return Err(invalid(&folder.name(), None, "feature maps", found, expected));
        }
        for frame in frames {
            if !files.contains_key(&frame.number) {
                let reason = format!("no such file in {} (frame {})", folder.name(), frame.number);
                return Err(SequenceError::Read {
                    file: format!("{:06}.npy", frame.number),
                    reason,
                });
            }
        }
        let mut features = Features { folder, files, channels: 0, first: String::new() };
        if let Some(frame) = frames.first() {
            let map = features.read(frame.number)?;
            features.channels = map.channels;
            features.first = features.files[&frame.number].clone();
        }
        Ok(features)
    }

    /// The feature map of a frame.
    pub fn read(&self, frame: u64) -> Result<FeatureMap, SequenceError> {
        let Some(file) = self.files.get(&frame) else {
            let reason = format!("no such file in {} (frame {frame})", self.folder.name());
            return Err(SequenceError::Read { file: format!("{frame:06}.npy"), reason });
        };
        let map = parse(&self.folder.read(file)?, file, frame)?;
        if self.channels > 0 && map.channels != self.channels {
            let expected = format!("{} as in {}", self.channels, self.first);
            let field = "channels of the feature map";
            return Err(invalid(file, Some(frame), field, map.channels.to_string(), expected));
        }
        Ok(map)
    }
}

/// A NumPy file (versions 1 to 3) of float32 or float16, little endian, C order, C x h x w.
fn parse(bytes: &[u8], file: &str, frame: u64) -> Result<FeatureMap, SequenceError> {
    let wrong = |field: &str, found: String, expected: &str| {
        Err(invalid(file, Some(frame), field, found, expected))
    };
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
            let found = other.unwrap_or("none").to_owned();
            return wrong("dtype of the feature map", found, "<f4 (float32) or <f2 (float16)");
        }
    };
    if !entry("fortran_order").is_some_and(|e| e.starts_with("False")) {
        let expected = "C order (numpy.ascontiguousarray)";
        return wrong("order of the feature map", "Fortran order".into(), expected);
    }
    let shape = entry("shape").and_then(|e| e.strip_prefix('(')?.split_once(')')).map(|e| e.0);
    let shape = shape.unwrap_or_default();
    let sizes: Vec<usize> =
        shape.split(',').filter_map(|n| n.trim().parse().ok()).filter(|n| *n > 0).collect();
    let dimensions = shape.split(',').filter(|n| !n.trim().is_empty()).count();
    let [channels, height, width] = sizes[..] else {
        return wrong(
            "shape of the feature map",
            format!("({shape})"),
            "(channels, height, width)",
        );
    };
    let too_large = channels > MAX_FEATURE_CHANNELS
        || height > MAX_FEATURE_SIDE
        || width > MAX_FEATURE_SIDE
        || dimensions != 3;
    if too_large {
        let expected = "3 sizes, none of them over 4096";
        return wrong("shape of the feature map", format!("({shape})"), expected);
    }
    let data = &rest[start + length..];
    let n = channels * height * width;
    if data.len() != n * size {
        let expected = format!("{} for the shape ({shape})", n * size);
        return wrong("bytes of the feature map", data.len().to_string(), &expected);
    }
    let values: Vec<f32> = if size == 4 {
        data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    } else {
        data.as_chunks().0.iter().map(|b| half(u16::from_le_bytes(*b))).collect()
    };
    if let Some(i) = values.iter().position(|v| !v.is_finite()) {
        let at = format!("{} at index {i}", values[i]);
        return wrong("values of the feature map", at, "finite numbers");
    }
    Ok(FeatureMap { channels, height, width, values })
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
pub(super) mod tests {
    use super::*;

    /// A NumPy file as `numpy.save` writes it.
    pub fn npy(dtype: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let mut header =
            format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}");
        while !(10 + header.len() + 1).is_multiple_of(64) {
            header.push(' ');
        }
        header.push('\n');
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend((header.len() as u16).to_le_bytes());
        out.extend(header.bytes());
        out.extend(data);
        out
    }

    /// C x h x w of float32, value i at index i.
    pub fn ramp(channels: usize, height: usize, width: usize) -> Vec<u8> {
        let data: Vec<u8> =
            (0..channels * height * width).flat_map(|i| (i as f32).to_le_bytes()).collect();
        npy("<f4", &format!("{channels}, {height}, {width}"), &data)
    }

    #[test]
    fn both_float_formats_are_read() {
        let map = parse(&ramp(2, 3, 4), "a.npy", 0).unwrap();
        assert_eq!((map.channels, map.height, map.width), (2, 3, 4));
        assert_eq!(map.values, (0..24).map(|i| i as f32).collect::<Vec<_>>());
        let bits = [0x3c00_u16, 0xc000, 0x3555, 0x0001, 0x7bff, 0x8000];
        let data: Vec<u8> = bits.iter().flat_map(|b| b.to_le_bytes()).collect();
        let map = parse(&npy("<f2", "1, 2, 3", &data), "a.npy", 0).unwrap();
        assert_eq!(map.values, [1.0, -2.0, 0.333_251_95, 5.960_464_5e-8, 65504.0, 0.0]);
    }

    #[test]
    fn what_is_no_feature_map_is_named() {
        let error = |bytes: &[u8]| parse(bytes, "features/000007.npy", 7).unwrap_err().to_string();
        let good = ramp(2, 3, 4);
        let fortran = String::from_utf8_lossy(&good).contains("False");
        assert!(fortran);
        let infinite: Vec<u8> = [1.0, f32::INFINITY].iter().flat_map(|x| x.to_le_bytes()).collect();
        for (bytes, parts) in [
            (b"PNG".to_vec(), ["feature map", "no NumPy file"]),
            (good[..20].to_vec(), ["NumPy header", "ends early"]),
            (good[..good.len() - 4].to_vec(), ["bytes", "found 92, expected 96"]),
            (npy("<f8", "1, 1, 1", &[0; 8]), ["dtype", "found <f8, expected <f4"]),
            (npy("<i4", "1, 1, 1", &[0; 4]), ["dtype", "<i4"]),
            (npy("<f4", "3, 4", &[0; 48]), ["shape", "(channels, height, width)"]),
            (npy("<f4", "0, 3, 4", &[]), ["shape", "found (0, 3, 4)"]),
            (npy("<f4", "5000, 1, 1", &[0; 20_000]), ["shape", "4096"]),
            (npy("<f4", "2, 1, 1", &infinite), ["values", "inf at index 1"]),
        ] {
            let text = error(&bytes);
            assert!(text.contains("features/000007.npy (frame 7)"), "{text}");
            assert!(parts.iter().all(|p| text.contains(p)), "{text}: {parts:?}");
        }
        // A byte more or less anywhere is an error or a map, never a panic.
        for cut in 0..good.len() {
            let _ = parse(&good[..cut], "a.npy", 0);
        }
    }
}
