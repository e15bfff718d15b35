// Sums rows of partial gradients in a fixed order. One invocation per column.
#import shared/dispatch.wgsl

#bindings

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
