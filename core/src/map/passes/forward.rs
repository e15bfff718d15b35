//! From the window's images to rays, samples, renderings and losses.
use crate::{
    call::Call,
    commands::Commands,
    kernels::{
        composite, decode_rays, geometry_forward, mask_rays, sample_depths, sample_rays,
        shared::{FLAG_MAP, FLAG_MASK, FLAG_POSE},
    },
    layout::FieldParams,
    map::{Batch, Map, Scratch, sample_head},
};

/// Rays, samples, signed distances, compositing, decoding and their losses. A per-sample head
/// is run here for views only: training runs it with its gradients, and poses do not see it.
pub fn record_forward(r: &mut Commands, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let full = map.params(b);
    let p = FieldParams { classes: map.ray_classes(), ..full };
    let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
    let (geometry, decoders) = (map.geometry.values, map.decoders.values);
    sample_rays::Buffers {
        poses: map.frames.poses,
        window: scratch.window,
        color_images: map.frames.color_images,
        depth_images: map.frames.depth_images,
        class_rarity: map.class_rarity,
        rays: scratch.rays,
    }
    .record(r, &full, rays);
    sample_depths::Buffers {
        rays: scratch.rays,
        planes_geometry: geometry,
        decoders,
        depths: scratch.depths,
    }
    .record(r, &p, rays);
    geometry_forward::Buffers {
        rays: scratch.rays,
        depths: scratch.depths,
        planes_geometry: geometry,
        decoders,
        features: scratch.features,
        distances: scratch.distances,
    }
    .record(r, &p, samples);
    composite::Buffers {
        rays: scratch.rays,
        depths: scratch.depths,
        distances: scratch.distances,
        planes_appearance: map.appearance.values,
        planes_semantic: map.semantic.values,
        weights: scratch.weights,
        ray_state: scratch.ray_state,
    }
    .record(r, &p, rays);
    decode_rays::Buffers {
        rays: scratch.rays,
        decoders,
        ray_state: scratch.ray_state,
        ray_out: scratch.ray_out,
        logits_gradient: scratch.logits_gradient,
        anchors: map.anchors(),
        targets: map.frames.targets,
        class_weights: map.class_weights,
    }
    .record(r, &p, rays);
    if b.flags & (FLAG_MAP | FLAG_POSE) == 0 {
        sample_head::record_classes(r, map, scratch, &full);
    }
    if b.flags & FLAG_MASK != 0 {
        mask_rays::Buffers { ray_out: scratch.ray_out }.record_workgroups(r, &p, [1, 1, 1]);
    }
}
