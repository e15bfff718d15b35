// Color decoder 32-32-3, semantic decoder 32-32-16, class head 16-C. Needs binding decoders: array<vec4f>.
// `sw` holds the layers from COLOR_W1 = 0 on; their offsets are those of src/decoders.rs.
// Loops stay loops here: these run once a ray, and unrolled they took a minute to compile on lavapipe.
#import shared/head.wgsl
var<workgroup> sw: array<vec4f, ${SURFACE_SIZE_VEC4}>;

fn load_surface_decoders(lane: u32) {
    for (var i = lane; i < ${SURFACE_SIZE_VEC4}u; i += WORKGROUP_SIZE) {
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
    h[${j}] = sw[${COLOR_B1+j}];
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
    var o = sw[${COLOR_B2}];
    for (var q = 0u; q < 8u; q++) {
        let w = ${COLOR_W2}u + q * 4u;
        o += h[q].x * sw[w] + h[q].y * sw[w + 1u] + h[q].z * sw[w + 2u] + h[q].w * sw[w + 3u];
    }
    return 1.0 / (1.0 + exp(-o.xyz));
}
// From the gradient at the color's pre-activation to the hidden layer's deltas.
fn color_hidden_delta(hidden: array<vec4f, 8>, d: vec4f) -> array<vec4f, 8> {
    var h = hidden;
    for (var q = 0u; q < 8u; q++) {
        let w = ${COLOR_W2}u + q * 4u;
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
    h[${j}] = sw[${SEMANTIC_B1+j}];
#end
    for (var q = 0u; q < 8u; q++) {
        let v = x[q];
        let w = ${SEMANTIC_W1}u + q * 32u;
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
    o[${j}] = sw[${SEMANTIC_B2+j}];
#end
    for (var q = 0u; q < 8u; q++) {
        let v = h[q];
        let w = ${SEMANTIC_W2}u + q * 16u;
#for j in 0..4
        o[${j}] += v.x * sw[w + ${j}u] + v.y * sw[w + ${j+4}u] + v.z * sw[w + ${j+8}u] + v.w * sw[w + ${j+12}u];
#end
    }
    return o;
}
