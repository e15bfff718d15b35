//! Feature maps: the first byte says in which format.
#![no_main]
use libfuzzer_sys::fuzz_target;
use mte_slam_dataset::fuzzing::parse_features;
use mte_slam_fuzz::limit_memory;

const FILES: [&str; 2] = ["000000.npy", "000000.safetensors"];

fuzz_target!(init: limit_memory(), |data: &[u8]| {
    let Some((&format, bytes)) = data.split_first() else { return };
    if let Ok(map) = parse_features(FILES[usize::from(format) % FILES.len()], bytes) {
        assert_eq!(map.values.len(), map.channels * map.height * map.width);
        assert!(!map.values.is_empty() && map.values.iter().all(|v| v.is_finite()));
    }
});
