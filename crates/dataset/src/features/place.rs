//! What both formats of feature maps share: errors, and numbers to a map.
use crate::folder::invalid;
use mte_slam_types::{
    frame::{FeatureMap, MAX_FEATURE_CHANNELS},
    sequence::SequenceError,
};

/// Longest side of a feature map.
const MAX_FEATURE_SIDE: usize = 4096;

/// The file and frame that messages are about.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub file: &'a str,
    pub frame: u64,
}

impl Place<'_> {
    pub fn wrong<T>(
        self,
        field: &str,
        found: impl ToString,
        expected: &str,
    ) -> Result<T, SequenceError> {
        Err(invalid(self.file, Some(self.frame), field, found.to_string(), expected))
    }

    /// The map of little-endian floats of `float_bytes` bytes (4 or 2) in C order, after the sizes
    /// that the file gives, which are checked; `shown` is how it puts them.
    pub fn map(
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

/// Returns a 16-bit float's value.
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
