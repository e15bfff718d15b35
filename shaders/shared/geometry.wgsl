// Look-up in the geometry planes. Needs binding planes_geometry: array<vec4f>, and geometry_mlp's decoders.
#import shared/geometry_mlp.wgsl

fn lookup_geometry(p: vec3f) -> array<vec4f, 8> {
    var f: array<vec4f, 8>;
    let local = p - params.box_min.xyz;
    let g0 = local * params.geometry_inv_cell.x;
    let g1 = local * params.geometry_inv_cell.y;
#for plane in 0..3
    {
        let a = plane_corners(${plane}u, g0, params.geometry_coarse);
        let b = plane_corners(${plane}u, g1, params.geometry_fine);
        let ai = a.cell * 4u;
        let bi = b.cell * 4u;
#for q in 0..4
        f[${q}] += a.weight.x * planes_geometry[ai.x + ${q}u] + a.weight.y * planes_geometry[ai.y + ${q}u]
            + a.weight.z * planes_geometry[ai.z + ${q}u] + a.weight.w * planes_geometry[ai.w + ${q}u];
        f[${q+4}] += b.weight.x * planes_geometry[bi.x + ${q}u] + b.weight.y * planes_geometry[bi.y + ${q}u]
            + b.weight.z * planes_geometry[bi.z + ${q}u] + b.weight.w * planes_geometry[bi.w + ${q}u];
#end
    }
#end
    return f;
}
