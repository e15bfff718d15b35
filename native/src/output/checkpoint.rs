//! `checkpoint.safetensors`: the map as a file.
use anyhow::{Context, Result};
use mte_slam_core::slam::Checkpoint;
use std::path::Path;

/// Read `OUT/checkpoint.safetensors`.
pub fn read_file(path: &Path) -> Result<Checkpoint> {
    let bytes = std::fs::read(path).with_context(|| {
        format!("{}: cannot be read; is this the output folder of a finished run?", path.display())
    })?;
    Checkpoint::from_bytes(&bytes)
        .with_context(|| format!("{}: not a whole checkpoint", path.display()))
}

#[cfg(test)]
mod tests {
    use mte_slam_core::slam::{Checkpoint, Dtype, Tensor};

    #[test]
    fn another_reader_agrees() {
        let bytes: Vec<u8> = (0..24).collect();
        let name = "a".to_owned();
        let tensor = Tensor { name, dtype: Dtype::F32, shape: vec![3, 2], bytes: bytes.clone() };
        let saved = Checkpoint { tensors: vec![tensor], ..Checkpoint::default() }.to_bytes();
        let file = safetensors::SafeTensors::deserialize(&saved).unwrap();
        let a = file.tensor("a").unwrap();
        assert_eq!(a.shape(), [3, 2]);
        assert_eq!(a.data(), bytes);
        assert_eq!(a.dtype(), safetensors::Dtype::F32);
    }
}
