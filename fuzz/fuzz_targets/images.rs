//! PNG and JPEG images as colour, depth and labels.
#![no_main]
use libfuzzer_sys::fuzz_target;
use mte_slam_dataset::{MAX_PIXELS, fuzzing::decode_image};
use mte_slam_fuzz::limit_memory;

fuzz_target!(init: limit_memory(), |data: &[u8]| {
    let found = decode_image(data);
    let size = found.labels.map(|(_, size)| size).or(found.size);
    let pixels = size.map(|(w, h)| w as usize * h as usize);
    let labels = found.labels.map(|(n, _)| n);
    for n in [found.color, found.depth, labels].into_iter().flatten() {
        assert_eq!(Some(n), pixels);
        assert!(n as u64 <= MAX_PIXELS);
    }
});
