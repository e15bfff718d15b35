//! Signed distance at every sample.
use super::shared::{FLAG_MAP, FLAG_POSE, Grid, Ray, geometry_decoder};
use super::{CpuDispatch, store_f32};
use crate::layout::FieldParams;

kernel! {
    /// Plane look-up and geometry decoder at every sample.
    pub static GEOMETRY_FORWARD = "geometry_forward" {
        workgroup_size: 64,
        params: FieldParams,
        twin: twin,
        bindings: [
            rays: Read,
            depths: Read,
            planes_geometry: Read,
            decoders: Read,
            features: ReadWrite,
            distances: ReadWrite,
        ],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let (rays, depths) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let (planes, decoders) = (dispatch.read_f32(2), dispatch.read_f32(3));
    let (features, distances) = (dispatch.write(4), dispatch.write(5));
    let grid = Grid::geometry(&p);
    let keep = p.flags & (FLAG_MAP | FLAG_POSE) != 0;
    dispatch.for_each_invocation(|sample| {
        if sample >= (p.rays * p.samples) as usize {
            return;
        }
        let ray = Ray::load(rays, sample / p.samples as usize);
        let f = grid.lookup(planes, ray.at(depths[sample]));
        store_f32(&distances[sample], geometry_decoder(decoders, &f).distance);
        if keep {
            for k in 0..32 {
                store_f32(&features[sample * 32 + k], f[k]);
            }
        }
    });
}
