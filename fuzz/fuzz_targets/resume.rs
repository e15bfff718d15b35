//! Going on from, and showing, a checkpoint with another state and other tensors: a bundle whose
//! file `state` replaces that entry, and whose others replace the tensors of these names.
#![no_main]
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use mte_slam_fuzz::{bundle, bundle::Bundle, limit_memory, state::Run};
use std::sync::LazyLock;

static RUN: LazyLock<Run> = LazyLock::new(Run::new);

fuzz_target!(
    init: {
        LazyLock::force(&RUN);
        limit_memory();
    },
    |data: &[u8]| RUN.go_on(&Bundle::parse(data))
);

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    bundle::mutate(data, size, max_size, seed, |bytes, n| {
        let room = bytes.len();
        fuzzer_mutate(bytes, n, room)
    })
});
