//! Recordings whose files are numbered: Replica (two kinds), 7-Scenes, exported ScanNet, images.
#![no_main]
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use mte_slam_core::dataset::Layout;
use mte_slam_fuzz::{bundle, bundle::Bundle, limit_memory, recordings};

const LAYOUTS: [Layout; 5] = [
    Layout::ReplicaNice,
    Layout::ReplicaVmap,
    Layout::SevenScenes,
    Layout::ScanNet,
    Layout::Images,
];

fuzz_target!(init: limit_memory(), |data: &[u8]| {
    let bundle = Bundle::parse(data);
    recordings::read(Box::new(bundle.source()), &bundle, &LAYOUTS);
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    bundle::mutate(data, size, max_size, seed, |bytes, n| {
        let room = bytes.len();
        fuzzer_mutate(bytes, n, room)
    })
});
