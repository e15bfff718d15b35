//! Signed distance at every sample.
use super::shared::{FLAG_MAP, FLAG_POSE, Grid, geometry_decoder};
use crate::kernel::{CpuDispatch, store_f32};
use crate::layout::FieldParams;

kernel! { pub static GEOMETRY_FORWARD = mte_slam_shaders::kernels::geometry_forward, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { rays, depths, planes_geometry: planes, decoders, features, distances } =
        dispatch.views();
    let grid = Grid::geometry(&p);
    let keep = p.flags & (FLAG_MAP | FLAG_POSE) != 0;
    dispatch.for_each_invocation(|sample| {
        if sample >= (p.rays * p.samples) as usize {
            return;
        }
        let ray = rays[sample / p.samples as usize];
        let f = grid.lookup(planes, ray.at(depths[sample]));
        store_f32(&distances[sample], geometry_decoder(decoders, &f).distance);
        if keep {
            for k in 0..32 {
                store_f32(&features[sample * 32 + k], f[k]);
            }
        }
    });
}
