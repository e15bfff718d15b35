//! Sums rows of partial gradients in a fixed order.
use super::{CpuDispatch, store_f32};

params! {
    /// Parameters of [`REDUCE_PARTIALS`].
    pub struct ReducePartialsParams {
        /// Rows to sum.
        rows: u32,
        /// Columns.
        columns: u32,
        /// Floats from one row to the next.
        row: u32,
        /// Where the result starts.
        offset: u32,
    }
}

kernel! {
    /// Column sums.
    pub static REDUCE_PARTIALS = "reduce_partials" {
        workgroup_size: 64,
        params: ReducePartialsParams,
        twin: twin,
        bindings: [partials: Read, gradient: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: ReducePartialsParams = dispatch.params();
    let (partials, gradient) = (dispatch.read_f32(0), dispatch.write(1));
    dispatch.for_each_invocation(|column| {
        if column >= p.columns as usize {
            return;
        }
        let sum = (0..p.rows as usize).map(|r| partials[r * p.row as usize + column]).sum();
        store_f32(&gradient[p.offset as usize + column], sum);
    });
}
