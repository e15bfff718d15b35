//! Packed recordings (`.sens`) with labels beside them.
#![no_main]
mte_slam_fuzz::fuzz_recordings!(Sens);
