//! Products of matrices: a layer on every sample, its gradients at inputs and at weights.
use super::{CpuDispatch, load_f32, store_f32};
use alloc::vec;

/// Rows and columns of the product that a workgroup makes.
pub const TILE: usize = 64;
/// No sums of columns.
pub const NO_SUMS: u32 = u32::MAX;

params! {
    /// Parameters of [`MATRIX_PRODUCT`]; offsets and distances are in floats.
    pub struct MatrixProductParams {
        /// Rows of the product.
        rows: u32,
        /// Columns of the product.
        columns: u32,
        /// Inner dimension.
        depth: u32,
        /// Inner indices a split; every split makes a product of its own.
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
        /// Where the sums of the right matrix's columns are added, or [`NO_SUMS`].
        sums_offset: u32,
    }
}

kernel! {
    /// product = left x right, with bias, rectifier, mask or sum as a layer needs it.
    pub static MATRIX_PRODUCT = "matrix_product" {
        workgroup_size: 256,
        params: MatrixProductParams,
        twin: twin,
        bindings: [left: Read, right: Read, mask: Read, product: ReadWrite],
    }
}

impl MatrixProductParams {
    /// Workgroups of a dispatch.
    pub fn workgroups(&self) -> [u32; 3] {
        let tiles = |n: u32| n.div_ceil(TILE as u32);
        [tiles(self.columns), tiles(self.rows), self.depth.div_ceil(self.split.max(1))]
    }
}

/// Inner indices that the twin packs at once: both tiles stay in the first-level cache.
const INNER: usize = 32;

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: MatrixProductParams = dispatch.params();
    let (left, right, mask) = (dispatch.read_f32(0), dispatch.read_f32(1), dispatch.read_f32(2));
    let product = dispatch.write(3);
    let [across, down, _] = dispatch.workgroups;
    let (right_row, right_column) = (p.right_row as usize, p.right_column as usize);
    dispatch.for_each_workgroup(|group| {
        let first_column = (group % across) as usize * TILE;
        let first_row = (group / across % down) as usize * TILE;
        let z = group / across / down;
        let begin = (z * p.split) as usize;
        let end = (begin + p.split as usize).min(p.depth as usize);
        let width = TILE.min(p.columns as usize - first_column);
        let height = TILE.min(p.rows as usize - first_row);
        let mut sums = vec![[0.0_f32; TILE]; TILE];
        let mut column_sums = [0.0_f32; TILE];
        let mut a = vec![[0.0_f32; TILE]; INNER];
        let mut b = vec![[0.0_f32; TILE]; INNER];
        let corner = p.right_offset as usize + first_column * right_column;
        for k0 in (begin..end).step_by(INNER) {
            let n = INNER.min(end - k0);
            let from = p.left_offset as usize
                + first_row * p.left_row as usize
                + k0 * p.left_column as usize;
            pack(&left[from..], p.left_column as usize, p.left_row as usize, height, &mut a[..n]);
            pack(&right[corner + k0 * right_row..], right_row, right_column, width, &mut b[..n]);
            multiply(&a[..n], &b[..n], height, &mut sums);
            for row in &b[..n] {
                column_sums.iter_mut().zip(row).for_each(|(s, x)| *s += x);
            }
        }
        let to = (p.product_offset + z * p.split_offset) as usize;
        for (r, sums) in sums.iter().enumerate().take(height) {
            let row = (first_row + r) * p.product_row as usize + first_column;
            for (c, sum) in sums.iter().enumerate().take(width) {
                let mut v = *sum;
                if p.bias == 1 {
                    v += right[corner + p.depth as usize * right_row + c * right_column];
                }
                if p.rectify == 1 {
                    v = v.max(0.0);
                }
                if p.masked == 1 && mask[p.mask_offset as usize + row + c] <= 0.0 {
                    v = 0.0;
                }
                let cell = &product[to + row + c];
                store_f32(cell, if p.accumulate == 1 { v + load_f32(cell) } else { v });
            }
        }
        if p.sums_offset != NO_SUMS && first_row == 0 {
            let to = (p.sums_offset + z * p.split_offset) as usize + first_column;
            for (cell, sum) in product[to..].iter().zip(&column_sums[..width]) {
                store_f32(cell, load_f32(cell) + sum);
            }
        }
    });
}

/// Copies a part of a matrix, inner index outermost, with zeros beyond `width`.
fn pack(from: &[f32], inner: usize, outer: usize, width: usize, tile: &mut [[f32; TILE]]) {
    for (k, row) in tile.iter_mut().enumerate() {
        row[width..].fill(0.0);
        if outer == 1 {
            row[..width].copy_from_slice(&from[k * inner..k * inner + width]);
        } else {
            for (i, x) in row[..width].iter_mut().enumerate() {
                *x = from[k * inner + i * outer];
            }
        }
    }
}

/// sums += a^T b, four inner indices at once: along a row of sums compilers vectorise it, and each
/// sum is loaded and stored once for four products.
fn multiply(a: &[[f32; TILE]], b: &[[f32; TILE]], height: usize, sums: &mut [[f32; TILE]]) {
    let (quads, rest) = b.as_chunks::<4>();
    for (i, sums) in sums.iter_mut().enumerate().take(height) {
        for (a, [b0, b1, b2, b3]) in a.as_chunks::<4>().0.iter().zip(quads) {
            let x = [a[0][i], a[1][i], a[2][i], a[3][i]];
            for c in 0..TILE {
                sums[c] = sums[c] + x[0] * b0[c] + x[1] * b1[c] + x[2] * b2[c] + x[3] * b3[c];
            }
        }
        for (a, b) in a[a.len() - rest.len()..].iter().zip(rest) {
            let x = a[i];
            sums.iter_mut().zip(b).for_each(|(s, b)| *s += x * b);
        }
    }
}
