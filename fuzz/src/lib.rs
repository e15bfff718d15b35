//! What the fuzz targets share: inputs of several named files, a mutator that keeps them whole,
//! a limit on memory, and what is done with a recording.
#![forbid(unsafe_code)]

pub mod bundle;
pub mod recordings;
pub mod state;

use cap::Cap;
use std::alloc::System;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// Most memory that any input may take \[bytes\]. A picture may have 64 million pixels.
const MAX_BYTES: usize = 1 << 30;

/// From now on an allocation beyond the limit ends the process, which libFuzzer reports.
pub fn limit_memory() {
    ALLOCATOR.set_limit(MAX_BYTES).expect("the program itself takes less");
}

/// The mutator of targets whose input is a bundle: it changes one file at a time. (A macro, since
/// libFuzzer's part must be linked into the target alone.)
#[macro_export]
macro_rules! mutate_bundles {
    () => {
        libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            $crate::bundle::mutate(data, size, max_size, seed, |bytes, n| {
                let room = bytes.len();
                libfuzzer_sys::fuzzer_mutate(bytes, n, room)
            })
        });
    };
}

/// A target that reads a bundle as a recording of each of these layouts.
#[macro_export]
macro_rules! fuzz_recordings {
    ($($layout:ident),+) => {
        libfuzzer_sys::fuzz_target!(init: $crate::limit_memory(), |data: &[u8]| {
            let bundle = $crate::bundle::Bundle::parse(data);
            let layouts = [$(mte_slam_dataset::Layout::$layout),+];
            $crate::recordings::read(Box::new(bundle.source()), &bundle, &layouts);
        });
        $crate::mutate_bundles!();
    };
}
