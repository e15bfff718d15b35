//! Products of matrices: a layer on every sample, its gradients at inputs and at weights.
pub use mte_slam_shaders::kernels::matrix_product::{MatrixProductParams, NO_SUMS, TILE};

use crate::kernel::{CpuDispatch, load_f32, store_f32};
use alloc::vec;

kernel! { pub static MATRIX_PRODUCT = mte_slam_shaders::kernels::matrix_product, twin }

/// Inner indices that the twin packs at once: both tiles stay in the first-level cache.
const INNER: usize = 32;

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: MatrixProductParams = dispatch.params();
    let Views { left, right, mask, product } = dispatch.views();
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
