//! The file of a checkpoint: what is read is the same when written and read again.
#![no_main]
use libfuzzer_sys::fuzz_target;
use mte_slam_core::slam::Checkpoint;
use mte_slam_fuzz::limit_memory;

fuzz_target!(init: limit_memory(), |data: &[u8]| {
    let Ok(checkpoint) = Checkpoint::from_bytes(data) else { return };
    let _ = checkpoint.frames();
    let again = Checkpoint::from_bytes(&checkpoint.to_bytes()).expect("a checkpoint");
    assert_eq!(again, checkpoint);
});
