//! Sums rows of partial gradients in a fixed order.

shared_struct! {
    /// Parameters of `reduce_partials`.
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

interface! {
    /// Column sums.
    pub reduce_partials {
        wgsl: shader!("reduce_partials"),
        workgroup_size: 64,
        params: ReducePartialsParams,
        bindings: {
            /// Rows of partial sums.
            partials: Read<f32>,
            /// Where the sums go.
            gradient: ReadWrite<f32>,
        }
    }
}
