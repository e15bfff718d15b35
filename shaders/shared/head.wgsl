// Class head 16-C. Needs binding decoders: array<vec4f> and params.classes.
fn class_logit(feature: array<vec4f, 4>, c: u32) -> f32 {
    let row = ${HEAD_VEC4}u + c * 4u;
    let bias = ${HEAD_VEC4}u * 4u + params.classes * 16u + c;
    return dot(decoders[row], feature[0]) + dot(decoders[row + 1u], feature[1]) + dot(decoders[row + 2u], feature[2])
        + dot(decoders[row + 3u], feature[3]) + decoders[bias / 4u][bias % 4u];
}
fn likeliest_class(feature: array<vec4f, 4>) -> u32 {
    var best = -1e30;
    var class_id = 255u;
    for (var c = 0u; c < params.classes; c++) {
        let logit = class_logit(feature, c);
        if (logit > best) {
            best = logit;
            class_id = c;
        }
    }
    return class_id;
}
