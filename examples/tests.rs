//! Runs every example.
#[path = "live_camera.rs"]
mod live_camera;
#[path = "map_a_room.rs"]
mod map_a_room;
#[path = "own_kernel.rs"]
mod own_kernel;
#[path = "own_source.rs"]
mod own_source;

use mte_slam_dataset::{OpenOptions, open};
use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
use mte_slam_types::sequence::Sequence;

#[test]
fn a_room_becomes_a_mesh() {
    let glb = map_a_room::map_a_room().unwrap();
    assert_eq!(&glb[..4], b"glTF");
    assert!(glb.len() > 100_000, "{} bytes", glb.len());
}

#[test]
fn a_live_camera_is_located_until_it_ends() {
    let frames = 6;
    let (info, driver) = live_camera::camera(frames);
    assert_eq!(info.frames, 0);
    let path = live_camera::map_live(&info, driver).unwrap();
    assert_eq!(path.len(), frames);
    // Without true poses the world is the first camera's frame.
    let room = SyntheticSequence::new(SyntheticOptions { frames, ..SyntheticOptions::tiny() });
    let first = room.truth(0).unwrap();
    for p in &path {
        let truth = first.inverse().compose(&room.truth(p.frame).unwrap());
        let gap_m = p.world_from_camera.translation.distance(truth.translation);
        assert!(gap_m < 0.02, "frame {}: {gap_m} m", p.frame);
    }
}

#[test]
fn a_kernel_of_ones_own_runs_on_both_engines() {
    own_kernel::own_kernel().unwrap();
}

#[test]
fn a_source_of_ones_own_is_read_as_a_recording() {
    let mut sequence =
        open(Box::new(own_source::recorded(2).unwrap()), OpenOptions::default()).unwrap();
    let mut room =
        SyntheticSequence::new(SyntheticOptions { frames: 2, ..SyntheticOptions::tiny() });
    assert_eq!(sequence.info().layout, "replica");
    for index in 0..2 {
        let (found, expected) = (sequence.frame(index).unwrap(), room.frame(index).unwrap());
        assert_eq!(found.depth, expected.depth);
        assert_eq!(found.color, expected.color);
    }
}
