// Neighbours and keys of the token grid. Needs the parameters `TokenParams`.
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
