//! From the losses back to gradients of planes, poses and what the decoders' gradients need.
use crate::{
    call::Call,
    commands::Commands,
    kernels::{
        composite_backward, geometry_backward, geometry_weights, pose_gradient, scatter_geometry,
        scatter_surface,
        shared::{FLAG_MAP, FLAG_POSE},
    },
    layout::{BACKWARD_STRIP, FieldParams},
    map::{Batch, Map, Scratch, sample_head, scratch::GEOMETRY_ROWS},
};

/// Gradients down to the signed distances and, as the flags say, features and positions.
pub fn record_backward(r: &mut Commands, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let p = map.params(b);
    let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
    let (geometry, decoders) = (map.geometry.values, map.decoders.values);
    composite_backward::Buffers {
        rays: scratch.rays,
        depths: scratch.depths,
        distances: scratch.distances,
        weights: scratch.weights,
        planes_appearance: map.appearance.values,
        ray_state: scratch.ray_state,
        ray_out: scratch.ray_out,
        distance_gradient: scratch.distance_gradient,
    }
    .record(r, &p, rays);
    if b.flags & FLAG_MAP != 0 {
        geometry_weights::Buffers {
            features: scratch.features,
            distance_gradient: scratch.distance_gradient,
            decoders,
            partials: scratch.geometry_partials,
        }
        .record_workgroups(r, &p, [GEOMETRY_ROWS, 1, 1]);
    }
    geometry_backward::Buffers {
        rays: scratch.rays,
        depths: scratch.depths,
        planes_geometry: geometry,
        decoders,
        distance_gradient: scratch.distance_gradient,
        features: scratch.features,
        position_gradient: scratch.position_gradient,
    }
    .record(r, &p, samples.div_ceil(BACKWARD_STRIP as usize));
    if b.flags & FLAG_POSE != 0 {
        pose_gradient::Buffers {
            rays: scratch.rays,
            depths: scratch.depths,
            position_gradient: scratch.position_gradient,
            ray_state: scratch.ray_state,
        }
        .record(r, &p, rays);
    }
    if b.flags & FLAG_MAP != 0 {
        scatter_geometry::Buffers {
            rays: scratch.rays,
            depths: scratch.depths,
            distance_gradient: scratch.distance_gradient,
            features: scratch.features,
            gradient: map.geometry.gradient,
            status: map.status,
        }
        .record(r, &p, rays * 24);
        record_scatter_surface(r, map, scratch, b);
        sample_head::record_backward(r, map, scratch, &p);
    }
}

/// Gradients of the semantics alone: what [`record_semantic_step`](super::record_semantic_step) needs.
pub(crate) fn record_semantic_backward(
    r: &mut Commands,
    map: &Map,
    scratch: &Scratch,
    b: &Batch<'_>,
) {
    if map.sample_head.is_some() {
        sample_head::record_backward(r, map, scratch, &map.params(b));
    } else {
        record_scatter_surface(r, map, scratch, b);
    }
}

fn record_scatter_surface(r: &mut Commands, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let p = FieldParams { classes: map.ray_classes(), ..map.params(b) };
    let rays = p.rays as usize;
    scatter_surface::Buffers {
        rays: scratch.rays,
        depths: scratch.depths,
        weights: scratch.weights,
        ray_state: scratch.ray_state,
        gradient_appearance: map.appearance.gradient,
        gradient_semantic: map.semantic.gradient,
        status: map.status,
    }
    .record(r, &p, rays * if p.classes > 0 { 48 } else { 24 });
}
