// Takes rays out of the tracking losses: those without depth, and those whose depth error exceeds ten times the
// median. One workgroup; the median comes from a histogram over the float's exponent and 4 bits of mantissa.
#bindings

// Bins from 2^-16 m on, 16 per octave.
var<workgroup> bins: array<atomic<u32>, 512>;
var<workgroup> threshold: f32;

fn bin_of(error: f32) -> u32 {
    return u32(clamp(i32(bitcast<u32>(error) >> 19u) - 1776, 0, 511));
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(local_invocation_index) lane: u32) {
    for (var ray = lane; ray < params.rays; ray += WORKGROUP_SIZE) {
        let error = ray_out[ray * 3u + 2u].z;
        if (error > 0.0) {
            atomicAdd(&bins[bin_of(error)], 1u);
        }
    }
    workgroupBarrier();
    if (lane == 0u) {
        var total = 0u;
        for (var i = 0u; i < 512u; i++) {
            total += atomicLoad(&bins[i]);
        }
        var seen = 0u;
        var i = 0u;
        while (i < 511u && (seen + atomicLoad(&bins[i])) * 2u < total) {
            seen += atomicLoad(&bins[i]);
            i++;
        }
        threshold = 10.0 * bitcast<f32>((i + 1777u) << 19u);
    }
    workgroupBarrier();
    for (var ray = lane; ray < params.rays; ray += WORKGROUP_SIZE) {
        let error = ray_out[ray * 3u + 2u].z;
        let masked = error <= 0.0 || error > threshold;
        ray_out[ray * 3u + 2u].w = select(0.0, 1.0, masked);
    }
}
