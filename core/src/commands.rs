//! An ordered list of device commands, built without touching a device.
use crate::kernel::Kernel;
use alloc::vec::Vec;
use bytemuck::Pod;
use core::{fmt, marker::PhantomData};

/// The most workgroups that WebGPU takes in one dimension of a dispatch.
pub const MAX_WORKGROUPS_PER_DIMENSION: u32 = 65_535;

/// Names a buffer of the engine that made it. Never reused within one engine.
#[derive(Copy, Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct BufferId(pub u32);

/// Names a buffer and what it holds: the elements that shaders declare.
pub struct Buffer<T> {
    id: BufferId,
    elements: PhantomData<fn() -> T>,
}

impl<T> Buffer<T> {
    /// A buffer that holds elements of `T`.
    pub const fn new(id: BufferId) -> Self {
        Self { id, elements: PhantomData }
    }

    /// The buffer's name without what it holds.
    pub const fn id(self) -> BufferId {
        self.id
    }

    /// The same buffer, float by float.
    pub const fn floats(self) -> Buffer<f32> {
        self.cast()
    }

    /// The same buffer for a kernel that takes its words for other elements.
    pub const fn cast<U>(self) -> Buffer<U> {
        Buffer::new(self.id)
    }
}

impl<T> Copy for Buffer<T> {}

impl<T> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> fmt::Debug for Buffer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.id.fmt(f)
    }
}

impl<T> From<Buffer<T>> for BufferId {
    fn from(buffer: Buffer<T>) -> BufferId {
        buffer.id
    }
}

/// One command for a device. Offsets and lengths count 4-byte words.
#[derive(Clone, Debug)]
pub enum Command {
    /// Writes host data into a buffer.
    Upload {
        /// Destination.
        buffer: BufferId,
        /// First word written.
        offset_words: usize,
        /// The words to write.
        data: Vec<u32>,
    },
    /// Sets a range to zero bits.
    Clear {
        /// Destination.
        buffer: BufferId,
        /// First word cleared.
        offset_words: usize,
        /// Number of words cleared.
        words: usize,
    },
    /// Copies between two different buffers.
    Copy {
        /// Source.
        src: BufferId,
        /// First word read.
        src_offset_words: usize,
        /// Destination, another buffer than the source.
        dst: BufferId,
        /// First word written.
        dst_offset_words: usize,
        /// Number of words copied.
        words: usize,
    },
    /// Runs a kernel.
    Dispatch {
        /// What to run.
        kernel: &'static Kernel,
        /// Buffers in the order of the kernel's bindings.
        bindings: Vec<BufferId>,
        /// The words of the kernel's parameter struct.
        params: Vec<u32>,
        /// Workgroups in x, y and z.
        workgroups: [u32; 3],
    },
}

/// Commands in the order in which they take effect. Each command sees the results of all earlier
/// ones. Mistakes (ranges, binding counts, unknown buffers) are reported when it is submitted.
#[derive(Clone, Debug, Default)]
pub struct Commands {
    /// The commands so far.
    pub list: Vec<Command>,
}

impl Commands {
    /// No commands.
    pub fn new() -> Self {
        Self::default()
    }

    /// Writes `data` at `offset_words`. Data whose size is not a multiple of 4 bytes is padded by
    /// zero bytes. Empty data records nothing.
    pub fn upload<T: Pod>(&mut self, buffer: impl Into<BufferId>, offset_words: usize, data: &[T]) {
        let (buffer, data) = (buffer.into(), to_words(data));
        if !data.is_empty() {
            self.list.push(Command::Upload { buffer, offset_words, data });
        }
    }

    /// Sets `words` words from `offset_words` on to zero.
    pub fn clear(&mut self, buffer: impl Into<BufferId>, offset_words: usize, words: usize) {
        let buffer = buffer.into();
        if words > 0 {
            self.list.push(Command::Clear { buffer, offset_words, words });
        }
    }

    /// Copies `words` words from `src` to `dst`, which must be different buffers.
    pub fn copy(
        &mut self,
        src: impl Into<BufferId>,
        src_offset_words: usize,
        dst: impl Into<BufferId>,
        dst_offset_words: usize,
        words: usize,
    ) {
        let (src, dst) = (src.into(), dst.into());
        if words > 0 {
            let command = Command::Copy { src, src_offset_words, dst, dst_offset_words, words };
            self.list.push(command);
        }
    }

    /// Runs `workgroups` workgroups of `kernel`; records nothing when any count is 0. `bindings`
    /// follow the order of the kernel's, `params` is its parameter struct. Where the kernel is known,
    /// [`Call`](crate::call::Call) is safer: it names the bindings.
    pub fn dispatch<P: Pod>(
        &mut self,
        kernel: &'static Kernel,
        params: &P,
        bindings: &[BufferId],
        workgroups: [u32; 3],
    ) {
        if !workgroups.contains(&0) {
            self.list.push(Command::Dispatch {
                kernel,
                bindings: bindings.to_vec(),
                params: to_words(core::slice::from_ref(params)),
                workgroups,
            });
        }
    }

    /// Runs at least `invocations` invocations, in whole workgroups spread over x and y (see
    /// [`workgroups_1d`]). The kernel must check its linear id against a count of its own.
    pub fn dispatch_1d<P: Pod>(
        &mut self,
        kernel: &'static Kernel,
        params: &P,
        bindings: &[BufferId],
        invocations: usize,
    ) {
        let workgroups = workgroups_1d(invocations, kernel.interface.workgroup_size);
        self.dispatch(kernel, params, bindings, workgroups);
    }

    /// Appends the commands of `other`.
    pub fn append(&mut self, other: Commands) {
        self.list.extend(other.list);
    }

    /// Forgets the commands and keeps the memory.
    pub fn reset(&mut self) {
        self.list.clear();
    }
}

/// Workgroup counts for a one-dimensional problem: linear workgroup id = x + y * count_x. Beyond
/// 65,535 workgroups, rows of equal length are used, with fewer than one row's worth of surplus
/// workgroups, so kernels check their bound. Counts beyond what x and y hold give a y over the
/// limit, which is refused at submission.
pub fn workgroups_1d(invocations: usize, workgroup_size: u32) -> [u32; 3] {
    let limit = MAX_WORKGROUPS_PER_DIMENSION as usize;
    let groups = invocations.div_ceil(workgroup_size.max(1) as usize);
    if groups <= limit {
        return [groups as u32, 1, 1];
    }
    let rows = groups.div_ceil(limit);
    [groups.div_ceil(rows) as u32, rows.min(u32::MAX as usize) as u32, 1]
}

/// The bytes of `data` as words, padded by zero bytes.
pub(crate) fn to_words<T: Pod>(data: &[T]) -> Vec<u32> {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let mut words = alloc::vec![0u32; bytes.len().div_ceil(4)];
    bytemuck::cast_slice_mut::<u32, u8>(&mut words)[..bytes.len()].copy_from_slice(bytes);
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_dimensional_counts_cover_and_stay_within_the_limit() {
        for groups in [0usize, 1, 65_535, 65_536, 131_071, 200_000, 65_535 * 65_535] {
            let [x, y, z] = workgroups_1d(groups * 64, 64);
            assert!(x <= MAX_WORKGROUPS_PER_DIMENSION && y <= MAX_WORKGROUPS_PER_DIMENSION);
            let covered = x as usize * y as usize * z as usize;
            assert!(covered >= groups && covered - groups < (y as usize).max(1));
        }
        assert_eq!(workgroups_1d(65, 64), [2, 1, 1]);
    }

    #[test]
    fn empty_work_records_nothing_and_bytes_are_padded() {
        let mut commands = Commands::new();
        commands.upload::<f32>(BufferId(0), 0, &[]);
        commands.clear(BufferId(0), 3, 0);
        commands.copy(BufferId(0), 0, BufferId(1), 0, 0);
        assert!(commands.list.is_empty());
        commands.upload(BufferId(0), 2, &[1u8, 2, 3, 4, 5]);
        match &commands.list[..] {
            [Command::Upload { data, .. }] => assert_eq!(data[..], [0x0403_0201, 5]),
            other => panic!("{other:?}"),
        }
    }
}
