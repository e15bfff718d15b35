//! From gradients at the signed distances to gradients at features and positions.
use super::shared::{
    FLAG_MAP, FLAG_POSE, Grid, geometry_decoder, geometry_deltas, geometry_feature_gradient,
};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::{BACKWARD_STRIP, FieldParams};

kernel! { pub static GEOMETRY_BACKWARD = mte_slam_shaders::kernels::geometry_backward, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        rays,
        depths,
        planes_geometry: planes,
        decoders,
        distance_gradient: gradient,
        features,
        position_gradient: positions,
    } = dispatch.views();
    let grid = Grid::geometry(&p);
    let count = (p.rays * p.samples) as usize;
    let one = |sample: usize| {
        let mut f = [0.0; 32];
        let mut dp = [0.0; 3];
        if gradient[sample] != 0.0 {
            for k in 0..32 {
                f[k] = load_f32(&features[sample * 32 + k]);
            }
            let s = geometry_decoder(decoders, &f);
            let d = geometry_deltas(decoders, &s, gradient[sample]);
            f = geometry_feature_gradient(decoders, &d);
            if p.flags & FLAG_POSE != 0 {
                let ray = rays[sample / p.samples as usize];
                dp = grid.lookup_gradient(planes, ray.at(depths[sample]), &f);
            }
        }
        if p.flags & FLAG_MAP != 0 {
            for k in 0..32 {
                store_f32(&features[sample * 32 + k], f[k]);
            }
        }
        if p.flags & FLAG_POSE != 0 {
            for k in 0..3 {
                store_f32(&positions[sample * 4 + k], dp[k]);
            }
            store_f32(&positions[sample * 4 + 3], 0.0);
        }
    };
    let strip = BACKWARD_STRIP as usize;
    dispatch.for_each_invocation(|id| (id * strip..((id + 1) * strip).min(count)).for_each(one));
}
