//! A kernel with its Rust twin, and what the twin sees of a dispatch.
use alloc::vec::Vec;
use bytemuck::Pod;
use core::{
    fmt,
    marker::PhantomData,
    slice,
    sync::atomic::{AtomicU32, Ordering::Relaxed},
};
use mte_slam_shaders::interface::{BindingSet, Element, Interface, Role, Source};

/// A kernel: its interface, whose shader runs on a device, and the same computation in Rust.
/// [`kernel!`](crate::kernel!) makes it.
pub struct Kernel {
    /// Shader, bindings, parameters.
    pub interface: &'static Interface,
    /// The same computation in Rust.
    pub twin: fn(&CpuDispatch<'_>),
}

impl fmt::Debug for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Kernel").field("name", &self.interface.name).finish_non_exhaustive()
    }
}

/// A bound buffer.
#[derive(Copy, Clone, Debug)]
pub enum CpuBinding<'a> {
    /// Bound for reading.
    Read(&'a [u32]),
    /// Bound for reading and writing; workgroups run in parallel, hence atomics.
    ReadWrite(&'a [AtomicU32]),
}

/// One dispatch of a kernel on the CPU engine.
pub struct CpuDispatch<'a> {
    /// Workgroups in x, y and z.
    pub workgroups: [u32; 3],
    /// Invocations per workgroup.
    pub workgroup_size: u32,
    params: &'a [u32],
    bindings: Vec<CpuBinding<'a>>,
}

impl<'a> CpuDispatch<'a> {
    /// A dispatch with the words of its parameter struct and its buffers in binding order.
    pub fn new(
        workgroups: [u32; 3],
        workgroup_size: u32,
        params: &'a [u32],
        bindings: Vec<CpuBinding<'a>>,
    ) -> Self {
        Self { workgroups, workgroup_size, params, bindings }
    }

    /// The parameter struct. A struct of another size than recorded (another kernel's) reads
    /// as zeros.
    pub fn params<P: Pod>(&self) -> P {
        let bytes: &[u8] = bytemuck::cast_slice(self.params);
        debug_assert!(bytes.len() >= size_of::<P>(), "parameter struct of another kernel");
        bytes.get(..size_of::<P>()).map_or_else(P::zeroed, bytemuck::pod_read_unaligned)
    }

    /// The buffers by the names of the kernel's bindings.
    pub fn views<B: BindingSet<Slices<'a>>>(&self) -> B {
        B::take(&mut Bound(self.bindings.iter()))
    }

    /// Number of invocations of the whole dispatch, at least 1.
    pub fn invocations(&self) -> usize {
        let workgroups = self.workgroups.iter().map(|n| *n as usize).product::<usize>();
        (workgroups * self.workgroup_size as usize).max(1)
    }

    /// Calls `body` with every linear workgroup id x + count_x * (y + count_y * z), in parallel
    /// and in any order with `threads`.
    pub fn for_each_workgroup(&self, body: impl Fn(u32) + Sync + Send) {
        let count = self.workgroups.iter().product::<u32>();
        #[cfg(feature = "threads")]
        {
            use rayon::prelude::*;
            (0..count).into_par_iter().for_each(body);
        }
        #[cfg(not(feature = "threads"))]
        (0..count).for_each(body);
    }

    /// Calls `body` with every linear invocation id (workgroup id times size plus local id);
    /// parallel over workgroups. `body` checks the id against the problem's size.
    pub fn for_each_invocation(&self, body: impl Fn(usize) + Sync + Send) {
        let size = self.workgroup_size as usize;
        self.for_each_workgroup(|workgroup| {
            let first = workgroup as usize * size;
            for id in first..first + size {
                body(id);
            }
        });
    }
}

/// Stands for bindings in a twin: slices of what the buffers hold. Buffers that the kernel writes are
/// words that invocations share, see [`load_f32`] and its like.
pub struct Slices<'a>(PhantomData<&'a ()>);

impl<'a> Role for Slices<'a> {
    type Read<T: Element> = &'a [T::Host];
    type ReadWrite<T: Element> = &'a [AtomicU32];
    type Atomic<T: Element> = &'a [AtomicU32];
}

/// The buffers of a dispatch that are not yet taken.
struct Bound<'d, 'a>(slice::Iter<'d, CpuBinding<'a>>);

impl<'a> Bound<'_, 'a> {
    fn words(&mut self) -> &'a [u32] {
        match self.0.next() {
            Some(CpuBinding::Read(words)) => words,
            other => {
                debug_assert!(false, "not bound for reading only: {other:?}");
                &[]
            }
        }
    }

    fn atomics(&mut self) -> &'a [AtomicU32] {
        match self.0.next() {
            Some(CpuBinding::ReadWrite(words)) => words,
            other => {
                debug_assert!(false, "not bound for writing: {other:?}");
                &[]
            }
        }
    }
}

impl<'a> Source<Slices<'a>> for Bound<'_, 'a> {
    fn read<T: Element>(&mut self) -> &'a [T::Host] {
        elements(self.words())
    }
    fn read_write<T: Element>(&mut self) -> &'a [AtomicU32] {
        self.atomics()
    }
    fn atomic<T: Element>(&mut self) -> &'a [AtomicU32] {
        self.atomics()
    }
}

/// The whole elements that `words` hold: buffers are rounded up to 4 words.
fn elements<T: Pod>(words: &[u32]) -> &[T] {
    let size = size_of::<T>() / 4;
    let whole = words.len() - words.len() % size.max(1);
    bytemuck::try_cast_slice(&words[..whole]).unwrap_or(&[])
}

/// The f32 in a word.
#[inline(always)]
pub fn load_f32(word: &AtomicU32) -> f32 {
    f32::from_bits(word.load(Relaxed))
}

/// Stores an f32.
#[inline(always)]
pub fn store_f32(word: &AtomicU32, value: f32) {
    word.store(value.to_bits(), Relaxed);
}

/// The i32 in a word.
#[inline(always)]
pub fn load_i32(word: &AtomicU32) -> i32 {
    word.load(Relaxed) as i32
}

/// Stores an i32.
#[inline(always)]
pub fn store_i32(word: &AtomicU32, value: i32) {
    word.store(value as u32, Relaxed);
}

/// The u32 in a word.
#[inline(always)]
pub fn load_u32(word: &AtomicU32) -> u32 {
    word.load(Relaxed)
}

/// Stores a u32.
#[inline(always)]
pub fn store_u32(word: &AtomicU32, value: u32) {
    word.store(value, Relaxed);
}

/// Adds with wrap-around and returns the value before, as WGSL's `atomicAdd` on `atomic<i32>`.
#[inline(always)]
pub fn add_i32(word: &AtomicU32, value: i32) -> i32 {
    word.fetch_add(value as u32, Relaxed) as i32
}

/// Sets bits and returns the value before, as WGSL's `atomicOr`.
#[inline(always)]
pub fn or_u32(word: &AtomicU32, bits: u32) -> u32 {
    word.fetch_or(bits, Relaxed)
}
