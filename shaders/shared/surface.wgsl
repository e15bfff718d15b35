// Colour decoder 32-32-3, semantic decoder 32-32-16, class head 16-C. Needs binding decoders: array<vec4f>.
// In `sw` (vec4): colour W1 0, b1 256, W2 264, b2 296; semantic W1 297, b1 553, W2 561, b2 689.
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
    var a${j} = sw[${j+256}];
#end
#for q in 0..8
#for c in 0..4
    {
        let v = vec4f(x[${q}][${c}]);
#for j in 0..8
        a${j} = fma(sw[${(q*4+c)*8+j}], v, a${j});
#end
    }
#end
#end
#for j in 0..8
    h[${j}] = max(a${j}, vec4f(0.0));
#end
    return h;
}
fn color_output(hidden: array<vec4f, 8>) -> vec3f {
    var h = hidden;
    var o = sw[296];
#for q in 0..8
#for c in 0..4
    o = fma(sw[${264+q*4+c}], vec4f(h[${q}][${c}]), o);
#end
#end
    return 1.0 / (1.0 + exp(-o.xyz));
}
fn semantic_hidden(f: array<vec4f, 8>) -> array<vec4f, 8> {
    var x = f;
    var h: array<vec4f, 8>;
#for j in 0..8
    var a${j} = sw[${j+553}];
#end
#for q in 0..8
#for c in 0..4
    {
        let v = vec4f(x[${q}][${c}]);
#for j in 0..8
        a${j} = fma(sw[${297+(q*4+c)*8+j}], v, a${j});
#end
    }
#end
#end
#for j in 0..8
    h[${j}] = max(a${j}, vec4f(0.0));
#end
    return h;
}
fn semantic_output(hidden: array<vec4f, 8>) -> array<vec4f, 4> {
    var h = hidden;
    var o: array<vec4f, 4>;
#for j in 0..4
    o[${j}] = sw[${j+689}];
#end
#for q in 0..8
#for c in 0..4
    {
        let v = vec4f(h[${q}][${c}]);
#for j in 0..4
        o[${j}] = fma(sw[${561+(q*4+c)*4+j}], v, o[${j}]);
#end
    }
#end
#end
    return o;
}
fn class_logit(feature: array<vec4f, 4>, c: u32) -> f32 {
    let row = ${HEAD_VEC4}u + c * 4u;
    let bias = ${HEAD_VEC4}u * 4u + params.classes * 16u + c;
    return dot(decoders[row], feature[0]) + dot(decoders[row + 1u], feature[1]) + dot(decoders[row + 2u], feature[2])
        + dot(decoders[row + 3u], feature[3]) + decoders[bias / 4u][bias % 4u];
}
