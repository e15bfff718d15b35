//! Going on from, and showing, a checkpoint with another state and other tensors: a bundle whose
//! file `state` replaces that entry, and whose others replace the tensors of these names.
#![no_main]
use libfuzzer_sys::fuzz_target;
use mte_slam_fuzz::{bundle::Bundle, limit_memory, state::Run};
use std::sync::LazyLock;

static RUN: LazyLock<Run> = LazyLock::new(Run::new);

fuzz_target!(
    init: {
        LazyLock::force(&RUN);
        limit_memory();
    },
    |data: &[u8]| RUN.go_on(&Bundle::parse(data))
);

mte_slam_fuzz::mutate_bundles!();
