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
