// Look-up in the semantic planes. Needs binding planes_semantic.
fn lookup_semantic(p: vec3f) -> array<vec4f, 8> {
    var f: array<vec4f, 8>;
    let local = p - params.box_min.xyz;
    let g0 = local * params.surface_inv_cell.x;
    let g1 = local * params.surface_inv_cell.y;
#for plane in 0..3
    {
        let a = plane_corners(${plane}u, g0, params.surface_coarse);
        let b = plane_corners(${plane}u, g1, params.surface_fine);
        let ai = a.cell * 4u;
        let bi = b.cell * 4u;
#for q in 0..4
        f[${q}] += a.weight.x * planes_semantic[ai.x + ${q}u] + a.weight.y * planes_semantic[ai.y + ${q}u]
            + a.weight.z * planes_semantic[ai.z + ${q}u] + a.weight.w * planes_semantic[ai.w + ${q}u];
        f[${q+4}] += b.weight.x * planes_semantic[bi.x + ${q}u] + b.weight.y * planes_semantic[bi.y + ${q}u]
            + b.weight.z * planes_semantic[bi.z + ${q}u] + b.weight.w * planes_semantic[bi.w + ${q}u];
#end
    }
#end
    return f;
}
