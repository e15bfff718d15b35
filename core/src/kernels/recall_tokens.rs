//! What the map already holds at the tokens' points.
use super::{
    CpuDispatch, load_f32,
    shared::{Grid, semantic_hidden, semantic_output, surface_weights},
    store_f32,
    tokens::{RAW_MEMORY, RAW_POINT},
};
use crate::layout::FieldParams;

kernel! {
    /// The map's semantic feature at each token's point, as an input of the fusion.
    pub static RECALL_TOKENS = "recall_tokens" {
        workgroup_size: 64,
        params: FieldParams,
        twin: twin,
        bindings: [planes_semantic: Read, decoders: Read, raw: ReadWrite],
    }
}

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let (planes, decoders) = (dispatch.read_f32(0), dispatch.read_f32(1));
    let raw = dispatch.write(2);
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
