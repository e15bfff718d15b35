//! Sums rows of partial gradients in a fixed order.
pub use mte_slam_shaders::kernels::reduce_partials::ReducePartialsParams;

use crate::kernel::{CpuDispatch, store_f32};

kernel! { pub static REDUCE_PARTIALS = mte_slam_shaders::kernels::reduce_partials, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: ReducePartialsParams = dispatch.params();
    let Views { partials, gradient } = dispatch.views();
    dispatch.for_each_invocation(|column| {
        if column >= p.columns as usize {
            return;
        }
        let sum = (0..p.rows as usize).map(|r| partials[r * p.row as usize + column]).sum();
        store_f32(&gradient[p.offset as usize + column], sum);
    });
}
