//! Loops over independent items: threads with the feature of that name, serial without. Results
//! never depend on how the work is split.
use alloc::vec::Vec;
#[cfg(feature = "threads")]
use rayon::prelude::*;

/// `f(0), f(1), ... f(n - 1)`, in that order.
#[cfg(feature = "threads")]
pub fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..n).into_par_iter().map(f).collect()
}

/// `f(0), f(1), ... f(n - 1)`, in that order.
#[cfg(not(feature = "threads"))]
pub fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..n).map(f).collect()
}

/// Calls `f(i, chunk)` for every chunk of `size` elements.
#[cfg(feature = "threads")]
pub fn for_chunks<T: Send>(data: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Sync + Send) {
    data.par_chunks_mut(size.max(1)).enumerate().for_each(|(i, chunk)| f(i, chunk));
}

/// Calls `f(i, chunk)` for every chunk of `size` elements.
#[cfg(not(feature = "threads"))]
pub fn for_chunks<T: Send>(data: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Sync + Send) {
    data.chunks_mut(size.max(1)).enumerate().for_each(|(i, chunk)| f(i, chunk));
}
