//! Normal equations of aligning a depth image to the field, one look-up per pixel.
use super::shared::{
    Grid, color_backward, color_hidden, color_output, cross, geometry_decoder, geometry_deltas,
    geometry_feature_gradient, surface_weights,
};
use crate::kernel::{CpuDispatch, store_f32};
use crate::layout::FieldParams;

/// Floats a workgroup writes.
pub const ALIGN_ROW: usize = 32;
/// Rec. 601 luma.
pub const LUMA: [f32; 3] = [0.299, 0.587, 0.114];

kernel! { pub static ALIGN_POINTS = mte_slam_shaders::kernels::align_points, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        poses,
        pixels,
        planes_geometry: geometry,
        planes_appearance: appearance,
        decoders,
        partials,
    } = dispatch.views();
    let (grid, surface_grid) = (Grid::geometry(&p), Grid::surface(&p));
    let surface = surface_weights(decoders);
    dispatch.for_each_workgroup(|group| {
        let mut sums = [0.0_f32; ALIGN_ROW];
        for i in group * 64..((group + 1) * 64).min(p.rays) {
            let q = &pixels[i as usize * 4..i as usize * 4 + 4];
            let row = |r: usize| poses[r] * q[0] + poses[r + 1] * q[1] + poses[r + 2] * q[2];
            let arm = [row(0), row(3), row(6)];
            let at: [f32; 3] = core::array::from_fn(|k| arm[k] + poses[9 + k]);
            let inside = (0..3).all(|k| at[k] > p.box_min[k] && at[k] < p.box_max[k]);
            if !inside || q[2] <= 0.0 {
                continue;
            }
            let state = geometry_decoder(decoders, &grid.lookup(geometry, at));
            if state.distance.abs() >= 0.95 {
                continue;
            }
            let rs = state.distance * p.truncation;
            let d = geometry_deltas(decoders, &state, 1.0);
            let gs = grid
                .lookup_gradient(geometry, at, &geometry_feature_gradient(decoders, &d))
                .map(|x| x * p.truncation);
            let hidden = color_hidden(surface, &surface_grid.lookup(appearance, at));
            let rgb = color_output(surface, &hidden);
            let rc = (0..3).map(|k| LUMA[k] * rgb[k]).sum::<f32>() - q[3];
            let mut dc = [0.0; 4];
            for k in 0..3 {
                dc[k] = LUMA[k] * rgb[k] * (1.0 - rgb[k]);
            }
            let (_, df) = color_backward(surface, &hidden, &dc);
            let gc = surface_grid.lookup_gradient(appearance, at, &df);
            let (es, ec) = (rs / p.robust_distance, rc / p.robust_intensity);
            let (bs, bc) = (1.0 / (1.0 + es * es), 1.0 / (1.0 + ec * ec));
            let ws = p.inv_sigma_distance * p.inv_sigma_distance * bs * bs;
            let wc = p.inv_sigma_intensity * p.inv_sigma_intensity * bc * bc;
            let (ms, mc) = (cross(arm, gs), cross(arm, gc));
            let js = [gs[0], gs[1], gs[2], ms[0], ms[1], ms[2]];
            let jc = [gc[0], gc[1], gc[2], mc[0], mc[1], mc[2]];
            let mut k = 0;
            for a in 0..6 {
                for b in a..6 {
                    sums[k] += ws * js[a] * js[b] + wc * jc[a] * jc[b];
                    k += 1;
                }
                sums[21 + a] += ws * js[a] * rs + wc * jc[a] * rc;
            }
            for (k, v) in [ws * rs * rs, wc * rc * rc, 1.0, rs.abs(), rc.abs()].iter().enumerate() {
                sums[27 + k] += v;
            }
        }
        for (k, v) in sums.iter().enumerate() {
            store_f32(&partials[group as usize * ALIGN_ROW + k], *v);
        }
    });
}
