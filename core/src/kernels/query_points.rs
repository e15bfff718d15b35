//! The field at single points.
use super::decode_rays::{anchor_class, nearest_anchor};
use super::shared::{
    FLAG_ANCHORS, FLAG_MAP, Grid, color_hidden, color_output, geometry_decoder, likeliest_class,
    semantic_hidden, semantic_output, surface_weights,
};
use crate::kernel::{CpuDispatch, store_f32, store_u32};
use crate::layout::{FieldParams, NO_ANCHOR};

kernel! { pub static QUERY_POINTS = mte_slam_shaders::kernels::query_points, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views {
        points,
        planes_geometry: geometry,
        planes_appearance: appearance,
        planes_semantic: semantic,
        decoders,
        anchors,
        values,
    } = dispatch.views();
    let (grid, surface_grid) = (Grid::geometry(&p), Grid::surface(&p));
    let surface = surface_weights(decoders);
    dispatch.for_each_invocation(|i| {
        if i >= p.rays as usize {
            return;
        }
        let at = [points[i * 4], points[i * 4 + 1], points[i * 4 + 2]];
        let distance = geometry_decoder(decoders, &grid.lookup(geometry, at)).distance;
        if p.flags & FLAG_MAP == 0 {
            store_f32(&values[i], distance);
            return;
        }
        let f = surface_grid.lookup(appearance, at);
        let rgb = color_output(surface, &color_hidden(surface, &f));
        let mut best_class = 255;
        if p.classes > 0 {
            let f = surface_grid.lookup(semantic, at);
            let feature = semantic_output(surface, &semantic_hidden(surface, &f));
            best_class = likeliest_class(decoders, &feature, p.classes);
            if p.flags & FLAG_ANCHORS != 0 {
                let nearest = nearest_anchor(&p, anchors, &feature, 255);
                if nearest.index != NO_ANCHOR {
                    best_class = anchor_class(&p, decoders, anchors, nearest.index);
                }
            }
        }
        store_f32(&values[i * 8], distance);
        store_u32(&values[i * 8 + 1], best_class);
        for k in 0..3 {
            store_f32(&values[i * 8 + 4 + k], rgb[k]);
        }
    });
}
