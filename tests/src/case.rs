//! One run of a kernel, and how far engines may differ in it.
use crate::Compare;
use mte_slam_core::kernel::Kernel;

/// One run of a kernel.
pub struct Case {
    /// What is special about it.
    pub name: &'static str,
    /// The kernel.
    pub kernel: &'static Kernel,
    /// Words of its parameters.
    pub params: Vec<u32>,
    /// Buffers in binding order.
    pub buffers: Vec<Vec<u32>>,
    /// Workgroups.
    pub workgroups: [u32; 3],
    /// How each binding may differ between engines.
    pub tolerance: Vec<Compare>,
    /// Bindings that the kernel overwrites completely.
    pub overwritten: Vec<&'static str>,
}

/// How far the engines may be apart. Both compute in f32 with another order of sums and another
/// exp, so: a few units of the last place (6e-8) times the number of terms behind a result
/// (32 to 64 in a layer, three layers), relative to the largest value of the column.
pub(crate) const SUMS: f32 = 2e-5;
