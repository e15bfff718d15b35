//! Recordings whose frames are listed in a file: TUM RGB-D and nerfstudio.
#![no_main]
mte_slam_fuzz::fuzz_recordings!(Tum, Nerfstudio);
