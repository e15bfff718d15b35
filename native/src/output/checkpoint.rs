//! `checkpoint.safetensors`: the map as a file.
use anyhow::{Context, Result};
use mte_slam_core::slam::Checkpoint;
use std::{
    fs::{self, File},
    io::{self, Write},
    path::Path,
};

/// Reads `OUT/checkpoint.safetensors`.
pub fn read_file(path: &Path) -> Result<Checkpoint> {
    let bytes = std::fs::read(path).with_context(|| {
        format!("{}: cannot be read; is this the output folder of a finished run?", path.display())
    })?;
    Checkpoint::from_bytes(&bytes)
        .with_context(|| format!("{}: not a whole checkpoint", path.display()))
}

/// Writes a checkpoint so that, whatever happens, either the old file or the new one is there,
/// whole. Returns its size \[bytes\].
pub fn write_file(path: &Path, checkpoint: &Checkpoint) -> Result<usize> {
    let temporary = path.with_extension("tmp");
    let written = write_and_sync(&temporary, path, checkpoint);
    if written.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    written.with_context(|| format!("{}: the checkpoint cannot be written", path.display()))
}

fn write_and_sync(temporary: &Path, path: &Path, checkpoint: &Checkpoint) -> io::Result<usize> {
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut file = File::create(temporary)?;
    let mut bytes = 0;
    for part in checkpoint.parts() {
        file.write_all(&part)?;
        bytes += part.len();
    }
    // A rename that reaches the disk before the data would leave an empty file after a power cut.
    file.sync_all()?;
    drop(file);
    fs::rename(temporary, path)?;
    #[cfg(unix)]
    File::open(folder)?.sync_all()?;
    Ok(bytes)
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
