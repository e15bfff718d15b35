//! PLY meshes: what is read can be written and is the same when read again.
#![no_main]
use libfuzzer_sys::fuzz_target;
use mte_slam_fuzz::limit_memory;
use mte_slam_mesh::{read_ply, write_ply};

fuzz_target!(init: limit_memory(), |data: &[u8]| {
    let Ok(mesh) = read_ply(data) else { return };
    let written = write_ply(&mesh).expect("what was read is consistent");
    let again = read_ply(&written).expect("what was written is a mesh");
    // Not the values: NaN differs from itself.
    assert_eq!(again.positions.len(), mesh.positions.len());
    assert_eq!(again.triangles, mesh.triangles);
    assert_eq!((again.colors, again.classes), (mesh.colors, mesh.classes));
});
