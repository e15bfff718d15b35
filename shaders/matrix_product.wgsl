// Product of two matrices, tile by tile through workgroup memory: a layer on every sample, its gradients at inputs,
// and those at weights. One workgroup per (64 rows, 64 columns, split of the inner dimension), one invocation per 4 x 4 of them.
#bindings

const NONE: u32 = 0xffffffffu;
const TILE: u32 = 64u;
const INNER: u32 = 16u;
// Both have the inner index outermost.
var<workgroup> left_tile: array<f32, 1024>;
var<workgroup> right_tile: array<vec4f, 256>;

fn right_at(k: u32, column: u32, end: u32) -> f32 {
    if (k >= end || column >= params.columns) {
        return 0.0;
    }
    return right[params.right_offset + k * params.right_row + column * params.right_column];
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first_column = wid.x * TILE;
    let first_row = wid.y * TILE;
    let tx = lane % 16u;
    let ty = lane / 16u;
    let begin = wid.z * params.split;
    let end = min(begin + params.split, params.depth);
    var sum: array<vec4f, 4>;
    var column_sum = vec4f(0.0);
    for (var k0 = begin; k0 < end; k0 += INNER) {
        for (var j = 0u; j < 4u; j++) {
            // Neighbouring invocations read neighbouring floats, whichever way the matrix lies.
            var k = (j * WORKGROUP_SIZE + lane) % INNER;
            var row = (j * WORKGROUP_SIZE + lane) / INNER;
            if (params.left_row == 1u) {
                k = (j * WORKGROUP_SIZE + lane) / TILE;
                row = (j * WORKGROUP_SIZE + lane) % TILE;
            }
            var x = 0.0;
            if (k0 + k < end && first_row + row < params.rows) {
                x = left[params.left_offset + (first_row + row) * params.left_row + (k0 + k) * params.left_column];
            }
            left_tile[k * TILE + row] = x;
        }
        {
            var k = lane / 16u;
            var quad = lane % 16u;
            if (params.right_row == 1u) {
                k = lane % INNER;
                quad = lane / INNER;
            }
            let column = first_column + quad * 4u;
            right_tile[k * 16u + quad] = vec4f(
                right_at(k0 + k, column, end), right_at(k0 + k, column + 1u, end),
                right_at(k0 + k, column + 2u, end), right_at(k0 + k, column + 3u, end));
        }
        workgroupBarrier();
        for (var k = 0u; k < INNER; k++) {
            let b = right_tile[k * 16u + tx];
            let at = k * TILE + ty * 4u;
            sum[0] += left_tile[at] * b;
            sum[1] += left_tile[at + 1u] * b;
            sum[2] += left_tile[at + 2u] * b;
            sum[3] += left_tile[at + 3u] * b;
        }
        column_sum += right_tile[ty * 16u + tx];
        workgroupBarrier();
    }
    let to = params.product_offset + wid.z * params.split_offset;
    for (var r = 0u; r < 4u; r++) {
        let row = first_row + ty * 4u + r;
        for (var c = 0u; c < 4u; c++) {
            let column = first_column + tx * 4u + c;
            if (row >= params.rows || column >= params.columns) {
                continue;
            }
            var v = sum[r][c];
            if (params.bias == 1u) {
                v += right[params.right_offset + params.depth * params.right_row + column * params.right_column];
            }
            if (params.rectify == 1u) {
                v = max(v, 0.0);
            }
            if (params.masked == 1u && mask[params.mask_offset + row * params.product_row + column] <= 0.0) {
                v = 0.0;
            }
            let at = to + row * params.product_row + column;
            if (params.accumulate == 1u) {
                v += product[at];
            }
            product[at] = v;
        }
    }
    if (params.sums_offset == NONE || wid.y != 0u) {
        return;
    }
    // Every invocation has summed the inner indices k = ty (mod 16) of its columns.
    right_tile[ty * 16u + tx] = column_sum;
    workgroupBarrier();
    if (lane < TILE && first_column + lane < params.columns) {
        var total = 0.0;
        for (var k = 0u; k < INNER; k++) {
            total += right_tile[k * 16u + lane / 4u][lane % 4u];
        }
        product[params.sums_offset + wid.z * params.split_offset + first_column + lane] += total;
    }
}
