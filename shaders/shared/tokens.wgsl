// Parameters of every kernel on the token grid. Twin: TokenParams in core/src/kernels/tokens.rs.
struct Params {
    // Grid [tokens], floats a token's activations and raw inputs take.
    columns: u32, rows: u32, stride: u32, raw_stride: u32,
    // Image [pixels], edge of a token [pixels], storage slot.
    width: u32, height: u32, size: u32, slot: u32,
    fx: f32, fy: f32, cx: f32, cy: f32,
    box_min: vec4f,
    // First of the raw inputs, of the dispatch's layers.
    depth_unit: f32, classes: u32, raw_at: u32, layer: u32,
    // First columns of queries (keys and values follow), of what is added, of the log-sum-exp.
    query: u32, residual: u32, statistics: u32, key_stride: u32,
    // First column of what attention gives.
    output: u32, chunk: u32, row: u32, train: u32,
    weight_class: f32, weight_color: f32, color_head: u32, spare0: u32,
}
@group(0) @binding(0) var<uniform> params: Params;

const NONE: u32 = 0xffffffffu;
// Slope of the leaky rectifiers below 0.
const SLOPE: f32 = 0.1;

fn key_columns() -> u32 {
    return (params.columns + params.key_stride - 1u) / params.key_stride;
}
fn key_count() -> u32 {
    return key_columns() * ((params.rows + params.key_stride - 1u) / params.key_stride);
}
fn key_token(key: u32) -> u32 {
    let n = key_columns();
    return key / n * params.key_stride * params.columns + key % n * params.key_stride;
}
// Token at an offset, NONE off the grid.
fn neighbour(token: u32, dx: i32, dy: i32) -> u32 {
    let x = i32(token % params.columns) + dx;
    let y = i32(token / params.columns) + dy;
    if (x < 0 || y < 0 || x >= i32(params.columns) || y >= i32(params.rows)) {
        return NONE;
    }
    return u32(y) * params.columns + u32(x);
}
