//! Feature maps in the safetensors format.
use super::place::Place;
use crate::folder::shortened;
use mte_slam_types::{frame::FeatureMap, safetensors, sequence::SequenceError};

/// What the files' names end in.
pub(super) const END: &str = ".safetensors";
/// Longest header: it describes a few tensors \[bytes\].
const MAX_HEADER_BYTES: usize = 1 << 20;
/// Name of the tensor that is meant where a file has several.
const NAME: &str = "features";

/// Reads the tensor `features`, or the only one: F32 or F16, C x h x w.
pub(super) fn parse(bytes: &[u8], at: Place<'_>) -> Result<FeatureMap, SequenceError> {
    let tensors = match safetensors::parse(bytes, MAX_HEADER_BYTES) {
        Ok(file) => file.tensors,
        Err(e) => return at.wrong(&format!("feature map: {}", e.field), e.found, &e.expected),
    };
    let named = tensors.iter().find(|t| t.name == NAME);
    let (Some(tensor), true) = (named.or(tensors.first()), named.is_some() || tensors.len() == 1)
    else {
        let names: Vec<String> = tensors.iter().take(4).map(|t| shortened(&t.name)).collect();
        let found = format!("{} ({})", tensors.len(), names.join(", "));
        return at.wrong("tensors", found, "one, or one named features");
    };
    let float_bytes = match tensor.dtype.as_str() {
        "F32" => 4,
        "F16" => 2,
        other => {
            let expected = "F32 (float32) or F16 (float16)";
            return at.wrong("dtype of the feature map", shortened(other), expected);
        }
    };
    let shown: String = format!("{:?}", tensor.shape).chars().take(40).collect();
    at.map(&tensor.shape, &shown, float_bytes, tensor.bytes)
}
