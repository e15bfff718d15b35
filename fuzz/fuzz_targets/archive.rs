//! Zip archives, and the recordings in them.
#![no_main]
use libfuzzer_sys::fuzz_target;
use mte_slam_dataset::{Layout, ZipSource};
use mte_slam_fuzz::{bundle::Bundle, limit_memory, recordings};
use mte_slam_types::sequence::Source;
use std::io::Cursor;

/// As an unpacked file may have at most \[bytes\].
const MAX_FILE_BYTES: u64 = 1 << 24;

fuzz_target!(init: limit_memory(), |data: &[u8]| {
    let archive = Cursor::new(data.to_vec());
    let Ok(source) = ZipSource::new("room.zip", archive, MAX_FILE_BYTES) else { return };
    let Ok(names) = source.list() else { return };
    for name in names.iter().take(4) {
        let Ok(size) = source.size(name) else { continue };
        let whole = source.read(name);
        if let Ok(whole) = &whole {
            assert_eq!(whole.len() as u64, size);
        }
        // Parts are the same bytes as the whole.
        for (offset, bytes) in [(0, 3), (size / 2, 5), (1, 9), (size, 1)] {
            if let (Ok(part), Ok(whole)) = (source.read_range(name, offset, bytes), &whole) {
                assert_eq!(part, whole[offset as usize..][..bytes]);
            }
        }
    }
    recordings::read(Box::new(source), &Bundle::default(), &Layout::ALL);
});
