//! What the map already holds at the tokens' points.
use super::{
    shared::{Grid, semantic_hidden, semantic_output, surface_weights},
    tokens::{RAW_MEMORY, RAW_POINT},
};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::FieldParams;

kernel! { pub static RECALL_TOKENS = mte_slam_shaders::kernels::recall_tokens, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { planes_semantic: planes, decoders, raw } = dispatch.views();
    let (grid, surface) = (Grid::surface(&p), surface_weights(decoders));
    dispatch.for_each_invocation(|token| {
        if token >= (p.token_columns * p.token_rows) as usize {
            return;
        }
        let out = &raw[token * p.raw_stride as usize..(token + 1) * p.raw_stride as usize];
        let at = |k: usize| load_f32(&out[RAW_POINT as usize + k]);
        if at(3) == 0.0 {
            return;
        }
        let f = grid.lookup(planes, [at(0), at(1), at(2)]);
        let feature = semantic_output(surface, &semantic_hidden(surface, &f));
        for (k, x) in feature.iter().enumerate() {
            store_f32(&out[RAW_MEMORY as usize + k], *x);
        }
    });
}
