//! From the losses back to gradients of planes, poses and what the decoders' gradients need.
use crate::{
    kernels::{
        composite_backward::COMPOSITE_BACKWARD,
        geometry_backward::GEOMETRY_BACKWARD,
        geometry_weights::GEOMETRY_WEIGHTS,
        pose_gradient::POSE_GRADIENT,
        scatter_geometry::SCATTER_GEOMETRY,
        scatter_surface::SCATTER_SURFACE,
        shared::{FLAG_MAP, FLAG_POSE},
    },
    layout::{BACKWARD_STRIP, FieldParams},
    map::{Batch, Map, Scratch, sample_head, scratch::GEOMETRY_ROWS},
    recording::Recording,
};

/// Gradients down to the signed distances and, as the flags say, features and positions.
pub fn record_backward(r: &mut Recording, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let p = map.params(b);
    let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
    let (geometry, decoders) = (map.geometry.values, map.decoders.values);
    r.dispatch_1d(
        &COMPOSITE_BACKWARD,
        &p,
        &[
            scratch.rays,
            scratch.depths,
            scratch.distances,
            scratch.weights,
            map.appearance.values,
            scratch.ray_state,
            scratch.ray_out,
            scratch.distance_gradient,
        ],
        rays,
    );
    if b.flags & FLAG_MAP != 0 {
        r.dispatch(
            &GEOMETRY_WEIGHTS,
            &p,
            &[scratch.features, scratch.distance_gradient, decoders, scratch.geometry_partials],
            [GEOMETRY_ROWS, 1, 1],
        );
    }
    r.dispatch_1d(
        &GEOMETRY_BACKWARD,
        &p,
        &[
            scratch.rays,
            scratch.depths,
            geometry,
            decoders,
            scratch.distance_gradient,
            scratch.features,
            scratch.position_gradient,
        ],
        samples.div_ceil(BACKWARD_STRIP as usize),
    );
    if b.flags & FLAG_POSE != 0 {
        r.dispatch_1d(
            &POSE_GRADIENT,
            &p,
            &[scratch.rays, scratch.depths, scratch.position_gradient, scratch.ray_state],
            rays,
        );
    }
    if b.flags & FLAG_MAP != 0 {
        r.dispatch_1d(
            &SCATTER_GEOMETRY,
            &p,
            &[
                scratch.rays,
                scratch.depths,
                scratch.distance_gradient,
                scratch.features,
                map.geometry.gradient,
                map.status,
            ],
            rays * 24,
        );
        record_scatter_surface(r, map, scratch, b);
        sample_head::record_backward(r, map, scratch, &p);
    }
}

/// Gradients of the semantics alone: what [`record_semantic_step`](super::record_semantic_step) needs.
pub fn record_semantic_backward(r: &mut Recording, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    if map.sample_head.is_some() {
        sample_head::record_backward(r, map, scratch, &map.params(b));
    } else {
        record_scatter_surface(r, map, scratch, b);
    }
}

fn record_scatter_surface(r: &mut Recording, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let p = FieldParams { classes: map.ray_classes(), ..map.params(b) };
    let rays = p.rays as usize;
    r.dispatch_1d(
        &SCATTER_SURFACE,
        &p,
        &[
            scratch.rays,
            scratch.depths,
            scratch.weights,
            scratch.ray_state,
            map.appearance.gradient,
            map.semantic.gradient,
            map.status,
        ],
        rays * if p.classes > 0 { 48 } else { 24 },
    );
}
