// Gradient of the geometry decoder: partial sums, one row per workgroup, laid out as the decoder.
// Activations and deltas of 64 samples meet in workgroup memory, then each lane sums its own weights.
// Only every decoder_stride-th tile is used, scaled up: an unbiased estimate at a fraction of the cost.
#import shared/geometry_mlp.wgsl

#bindings

// 64 samples x (8 vec4 inputs + 4 vec4 deltas).
var<workgroup> tile: array<vec4f, 768>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) wid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    load_geometry_decoder(lane);
    let count = params.rays * params.samples;
    let tiles = (count + 63u) / 64u;
    var w1a = vec4f(0.0);
    var w1b = vec4f(0.0);
    var w2 = vec4f(0.0);
    var small = vec4f(0.0);
    let stride = max(params.decoder_stride, 1u);
    for (var t = wid.x * stride + params.iteration % stride; t < tiles; t += groups.x * stride) {
        let sample = t * 64u + lane;
        var f: array<vec4f, 8>;
        var g = 0.0;
        if (sample < count) {
            g = distance_gradient[sample] * f32(stride);
#for q in 0..8
            f[${q}] = features[sample * 8u + ${q}u];
#end
        }
        var s = geometry_decoder(f);
        var d = geometry_deltas(s, g);
        // Layer 1: 32 inputs, deltas d1.
#for q in 0..8
        tile[lane * 12u + ${q}u] = f[${q}];
#end
#for q in 0..4
        tile[lane * 12u + ${q+8}u] = d.d1[${q}];
#end
        workgroupBarrier();
        for (var k = 0u; k < 64u; k++) {
            let x = tile[k * 12u + lane / 8u][(lane / 2u) % 4u];
            let j = k * 12u + 8u + (lane % 2u) * 2u;
            w1a += x * tile[j];
            w1b += x * tile[j + 1u];
            if (lane < 4u) {
                small += tile[k * 12u + 8u + lane];
            }
        }
        workgroupBarrier();
        // Layer 2: 16 inputs h1, deltas d2. Layer 3: inputs h2, delta d3.
#for q in 0..4
        tile[lane * 12u + ${q}u] = s.h1[${q}];
        tile[lane * 12u + ${q+4}u] = s.h2[${q}] * d.d3;
        tile[lane * 12u + ${q+8}u] = d.d2[${q}];
#end
        workgroupBarrier();
        for (var k = 0u; k < 64u; k++) {
            let x = tile[k * 12u + lane / 16u][(lane / 4u) % 4u];
            w2 += x * tile[k * 12u + 8u + lane % 4u];
            if (lane >= 4u && lane < 8u) {
                small += tile[k * 12u + 4u + lane];
            } else if (lane >= 8u && lane < 12u) {
                small += tile[k * 12u + lane - 4u];
            }
        }
        workgroupBarrier();
        tile[lane * 12u] = vec4f(d.d3, 0.0, 0.0, 0.0);
        workgroupBarrier();
        if (lane == 12u) {
            for (var k = 0u; k < 64u; k++) {
                small += tile[k * 12u];
            }
        }
        workgroupBarrier();
    }
    // Lanes 0 to 3 hold sums of b1, 4 to 7 of b2, 8 to 11 of W3, lane 12 of b3.
    let row = wid.x * ${SURFACE_VEC4}u;
    partials[row + lane * 2u] = w1a;
    partials[row + lane * 2u + 1u] = w1b;
    partials[row + ${GEOMETRY_W2}u + lane] = w2;
    if (lane < 4u) {
        partials[row + ${GEOMETRY_B1}u + lane] = small;
    } else if (lane < 8u) {
        partials[row + ${GEOMETRY_B2}u + lane - 4u] = small;
    } else if (lane < 12u) {
        partials[row + ${GEOMETRY_W3}u + lane - 8u] = small;
    } else if (lane == 12u) {
        partials[row + ${GEOMETRY_B3}u] = small;
    }
}
