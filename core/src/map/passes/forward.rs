//! From the window's images to rays, samples, renderings and losses.
use crate::{
    kernels::{
        composite::COMPOSITE,
        decode_rays::DECODE_RAYS,
        geometry_forward::GEOMETRY_FORWARD,
        mask_rays::MASK_RAYS,
        sample_depths::SAMPLE_DEPTHS,
        sample_rays::SAMPLE_RAYS,
        shared::{FLAG_MAP, FLAG_MASK, FLAG_POSE},
    },
    layout::FieldParams,
    map::{Batch, Map, Scratch, sample_head},
    recording::Recording,
};

/// Rays, samples, signed distances, compositing, decoding and their losses. A per-sample head
/// is run here for views only: training runs it with its gradients, and poses do not see it.
pub fn record_forward(r: &mut Recording, map: &Map, scratch: &Scratch, b: &Batch<'_>) {
    let full = map.params(b);
    let p = FieldParams { classes: map.ray_classes(), ..full };
    let (rays, samples) = (p.rays as usize, (p.rays * p.samples) as usize);
    let (geometry, decoders) = (map.geometry.values, map.decoders.values);
    r.dispatch_1d(
        &SAMPLE_RAYS,
        &full,
        &[
            map.frames.poses,
            scratch.window,
            map.frames.color_images,
            map.frames.depth_images,
            map.class_rarity,
            scratch.rays,
        ],
        rays,
    );
    r.dispatch_1d(&SAMPLE_DEPTHS, &p, &[scratch.rays, geometry, decoders, scratch.depths], rays);
    r.dispatch_1d(
        &GEOMETRY_FORWARD,
        &p,
        &[scratch.rays, scratch.depths, geometry, decoders, scratch.features, scratch.distances],
        samples,
    );
    r.dispatch_1d(
        &COMPOSITE,
        &p,
        &[
            scratch.rays,
            scratch.depths,
            scratch.distances,
            map.appearance.values,
            map.semantic.values,
            scratch.weights,
            scratch.ray_state,
        ],
        rays,
    );
    r.dispatch_1d(
        &DECODE_RAYS,
        &p,
        &[
            scratch.rays,
            decoders,
            scratch.ray_state,
            scratch.ray_out,
            scratch.logits_gradient,
            map.anchors(),
            map.frames.targets,
            map.class_weights,
        ],
        rays,
    );
    if b.flags & (FLAG_MAP | FLAG_POSE) == 0 {
        sample_head::record_classes(r, map, scratch, &full);
    }
    if b.flags & FLAG_MASK != 0 {
        r.dispatch(&MASK_RAYS, &p, &[scratch.ray_out], [1, 1, 1]);
    }
}
