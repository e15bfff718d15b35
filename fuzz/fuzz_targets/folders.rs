//! Recordings whose files are numbered: Replica (two kinds), 7-Scenes, exported ScanNet, Stray Scanner, Polycam,
//! images.
#![no_main]
mte_slam_fuzz::fuzz_recordings!(
    ReplicaNice,
    ReplicaVmap,
    SevenScenes,
    ScanNet,
    Stray,
    Polycam,
    Images
);
