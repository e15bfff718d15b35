//! Products of matrices: a layer on every sample, its gradients at inputs and at weights.

/// Rows and columns of the product that a workgroup makes.
pub const TILE: usize = 64;
/// No sums of columns.
pub const NO_SUMS: u32 = u32::MAX;

shared_struct! {
    /// Parameters of `matrix_product`; offsets and distances are in floats.
    pub struct MatrixProductParams {
        /// Rows of the product.
        rows: u32,
        /// Columns of the product.
        columns: u32,
        /// Inner dimension.
        depth: u32,
        /// Inner indices per split; every split makes a product of its own.
        split: u32,
        /// First float of the left matrix.
        left_offset: u32,
        /// From a row of the left matrix to the next.
        left_row: u32,
        /// From a column of the left matrix to the next.
        left_column: u32,
        /// First float of the right matrix.
        right_offset: u32,
        /// From a row of the right matrix to the next.
        right_row: u32,
        /// From a column of the right matrix to the next.
        right_column: u32,
        /// First float of the product.
        product_offset: u32,
        /// From a row of the product to the next.
        product_row: u32,
        /// From a split's product to the next one's.
        split_offset: u32,
        /// 1: add row `depth` of the right matrix to every row.
        bias: u32,
        /// 1: no value below 0.
        rectify: u32,
        /// 1: 0 where the mask is not above 0.
        masked: u32,
        /// 1: add to what is there.
        accumulate: u32,
        /// First float of the mask, which lies as the product does.
        mask_offset: u32,
        /// Where the sums of the right matrix's columns are added, or `NO_SUMS`.
        sums_offset: u32,
    }
}

impl MatrixProductParams {
    /// Workgroups of a dispatch.
    pub fn workgroups(&self) -> [u32; 3] {
        let tiles = |n: u32| n.div_ceil(TILE as u32);
        [tiles(self.columns), tiles(self.rows), self.depth.div_ceil(self.split.max(1))]
    }
}

interface! {
    /// product = left x right, with bias, rectifier, mask or sum as a layer needs it.
    pub matrix_product {
        wgsl: shader!("matrix_product"),
        workgroup_size: 256,
        params: MatrixProductParams,
        bindings: {
            /// Left matrix.
            left: Read<f32>,
            /// Right matrix.
            right: Read<f32>,
            /// Where it is not above 0, a masked product is 0.
            mask: Read<f32>,
            /// Product.
            product: ReadWrite<f32>,
        }
    }
}
