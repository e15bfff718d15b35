// Sums rows of partial gradients in a fixed order. One invocation a column.
#import shared/dispatch.wgsl

struct Params {
    rows: u32,
    // Columns, and floats between rows.
    columns: u32,
    row: u32,
    // Where the result goes.
    offset: u32,
}
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> partials: array<f32>;
@group(0) @binding(2) var<storage, read_write> gradient: array<f32>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let column = linear_invocation(wid, groups, lane);
    if (column >= params.columns) {
        return;
    }
    var sum = 0.0;
    for (var r = 0u; r < params.rows; r++) {
        sum += partials[r * params.row + column];
    }
    gradient[params.offset + column] = sum;
}
