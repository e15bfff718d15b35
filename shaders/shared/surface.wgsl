// Colour decoder 32-32-3, semantic decoder 32-32-16, class head 16-C. Needs binding decoders: array<vec4f>.
// In `sw` (vec4): colour W1 0, b1 256, W2 264, b2 296; semantic W1 297, b1 553, W2 561, b2 689.
// Loops stay loops here: these run once a ray, and unrolled they took a minute to compile on lavapipe.
#import shared/head.wgsl
var<workgroup> sw: array<vec4f, 693>;

fn load_surface_decoders(lane: u32) {
    for (var i = lane; i < 693u; i += WORKGROUP_SIZE) {
        sw[i] = decoders[i + ${SURFACE_VEC4}u];
    }
    workgroupBarrier();
}
fn dot8(base: u32, v: array<vec4f, 8>) -> f32 {
    return dot(sw[base], v[0]) + dot(sw[base + 1u], v[1]) + dot(sw[base + 2u], v[2]) + dot(sw[base + 3u], v[3])
        + dot(sw[base + 4u], v[4]) + dot(sw[base + 5u], v[5]) + dot(sw[base + 6u], v[6]) + dot(sw[base + 7u], v[7]);
}
fn dot4(base: u32, v: array<vec4f, 4>) -> f32 {
    return dot(sw[base], v[0]) + dot(sw[base + 1u], v[1]) + dot(sw[base + 2u], v[2]) + dot(sw[base + 3u], v[3]);
}
fn color_hidden(f: array<vec4f, 8>) -> array<vec4f, 8> {
    var x = f;
    var h: array<vec4f, 8>;
#for j in 0..8
    h[${j}] = sw[${j+256}];
#end
    for (var q = 0u; q < 8u; q++) {
        let v = x[q];
        let w = 0u + q * 32u;
#for j in 0..8
        h[${j}] += v.x * sw[w + ${j}u] + v.y * sw[w + ${j+8}u] + v.z * sw[w + ${j+16}u] + v.w * sw[w + ${j+24}u];
#end
    }
#for j in 0..8
    h[${j}] = max(h[${j}], vec4f(0.0));
#end
    return h;
}
fn color_output(hidden: array<vec4f, 8>) -> vec3f {
    var h = hidden;
    var o = sw[296];
    for (var q = 0u; q < 8u; q++) {
        let w = 264u + q * 4u;
        o += h[q].x * sw[w] + h[q].y * sw[w + 1u] + h[q].z * sw[w + 2u] + h[q].w * sw[w + 3u];
    }
    return 1.0 / (1.0 + exp(-o.xyz));
}
// From the gradient at the colour's pre-activation to the hidden layer's deltas.
fn color_hidden_delta(hidden: array<vec4f, 8>, d: vec4f) -> array<vec4f, 8> {
    var h = hidden;
    for (var q = 0u; q < 8u; q++) {
        let w = 264u + q * 4u;
        let t = vec4f(dot(sw[w], d), dot(sw[w + 1u], d), dot(sw[w + 2u], d), dot(sw[w + 3u], d));
        h[q] = select(vec4f(0.0), t, h[q] > vec4f(0.0));
    }
    return h;
}
// dL/d(inputs 4q..4q+3) of a 32-32 layer that starts at `base`, from its deltas.
fn input_gradient(base: u32, q: u32, d: array<vec4f, 8>) -> vec4f {
    let w = base + q * 32u;
    return vec4f(dot8(w, d), dot8(w + 8u, d), dot8(w + 16u, d), dot8(w + 24u, d));
}
fn semantic_hidden(f: array<vec4f, 8>) -> array<vec4f, 8> {
    var x = f;
    var h: array<vec4f, 8>;
#for j in 0..8
    h[${j}] = sw[${j+553}];
#end
    for (var q = 0u; q < 8u; q++) {
        let v = x[q];
        let w = 297u + q * 32u;
#for j in 0..8
        h[${j}] += v.x * sw[w + ${j}u] + v.y * sw[w + ${j+8}u] + v.z * sw[w + ${j+16}u] + v.w * sw[w + ${j+24}u];
#end
    }
#for j in 0..8
    h[${j}] = max(h[${j}], vec4f(0.0));
#end
    return h;
}
fn semantic_output(hidden: array<vec4f, 8>) -> array<vec4f, 4> {
    var h = hidden;
    var o: array<vec4f, 4>;
#for j in 0..4
    o[${j}] = sw[${j+689}];
#end
    for (var q = 0u; q < 8u; q++) {
        let v = h[q];
        let w = 561u + q * 16u;
#for j in 0..4
        o[${j}] += v.x * sw[w + ${j}u] + v.y * sw[w + ${j+4}u] + v.z * sw[w + ${j+8}u] + v.w * sw[w + ${j+12}u];
#end
    }
    return o;
}
