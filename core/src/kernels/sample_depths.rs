//! Depth sampling: guided by the sensor's depth, or by the trained signed distance.
use super::shared::{
    FLAG_DENSE, FLAG_GUIDED, Grid, Ray, geometry_decoder, interval_alpha, phi, random_f32,
};
use crate::kernel::{CpuDispatch, store_f32};
use crate::layout::{FieldParams, MAX_STRATIFIED};
use mte_slam_shaders::random::salt;

kernel! { pub static SAMPLE_DEPTHS = mte_slam_shaders::kernels::sample_depths, twin }

/// Depth at which a ray leaves the box.
fn exit_depth(p: &FieldParams, ray: &Ray) -> f32 {
    let mut exit = f32::MAX;
    for k in 0..3 {
        let d = ray.direction[k];
        let inv = 1.0 / if d.abs() < 1e-9 { 1e-9 } else { d };
        let t = ((p.box_min[k] - ray.origin[k]) * inv).max((p.box_max[k] - ray.origin[k]) * inv);
        exit = exit.min(t);
    }
    exit
}

fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { rays, planes_geometry: planes, decoders, depths } = dispatch.views();
    let grid = Grid::geometry(&p);
    dispatch.for_each_invocation(|id| {
        if id >= p.rays as usize {
            return;
        }
        let ray = rays[id];
        let jitter = |k: usize| {
            if p.flags & FLAG_DENSE != 0 {
                0.5
            } else {
                random_f32(p.seed, p.iteration, id as u32 * 256 + k as u32, salt::JITTER)
            }
        };
        let (n, m) = ((p.stratified.min(MAX_STRATIFIED)) as usize, p.surface_samples as usize);
        let near = p.near;
        let mut far = exit_depth(&p, &ray).max(near + 0.1);
        let guided = p.flags & FLAG_GUIDED != 0 && ray.depth > 0.0;
        let (mut first, mut last) = (0.0, 0.0);
        if guided {
            far = (ray.depth + 1.5 * p.truncation).max(near + 0.1);
            first = (ray.depth - 1.5 * p.truncation).max(near);
            last = far;
        }
        let step = (far - near) / n as f32;
        let mut coarse = [0.0; MAX_STRATIFIED as usize];
        let mut cumulative = [0.0; MAX_STRATIFIED as usize];
        for j in 0..n {
            coarse[j] = near + (j as f32 + jitter(j)) * step;
        }
        let mut total = 0.0;
        if !guided {
            let (mut transmittance, mut previous) = (1.0, 1.0);
            for j in 0..n {
                let f = grid.lookup(planes, ray.at(coarse[j]));
                let here = phi(p.sharpness, geometry_decoder(decoders, &f).distance);
                if j > 0 {
                    let alpha = interval_alpha(previous, here);
                    total += transmittance * alpha;
                    transmittance *= 1.0 - alpha;
                }
                cumulative[j] = total;
                previous = here;
            }
        }
        let (mut i, mut interval) = (0, 1);
        let out = &depths[id * p.samples as usize..(id + 1) * p.samples as usize];
        for k in 0..m {
            let u = (k as f32 + jitter(n + k)) / m as f32;
            let mut z = mix(first, last, u);
            if !guided {
                if total < 1e-2 {
                    z = mix(near, far, u);
                } else {
                    let mass_before = u * total;
                    while interval < n - 1 && cumulative[interval] < mass_before {
                        interval += 1;
                    }
                    let low = cumulative[interval - 1];
                    let mass = (cumulative[interval] - low).max(1e-9);
                    let t = ((mass_before - low) / mass).clamp(0.0, 1.0);
                    z = mix(coarse[interval - 1], coarse[interval], t);
                }
            }
            while i < n && coarse[i] <= z {
                store_f32(&out[i + k], coarse[i]);
                i += 1;
            }
            store_f32(&out[i + k], z);
        }
        while i < n {
            store_f32(&out[i + m], coarse[i]);
            i += 1;
        }
    });
}
