// Look-up in the appearance planes and its spatial derivative. Needs binding planes_appearance.
fn lookup_appearance(p: vec3f) -> array<vec4f, 8> {
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
        f[${q}] += a.weight.x * planes_appearance[ai.x + ${q}u] + a.weight.y * planes_appearance[ai.y + ${q}u]
            + a.weight.z * planes_appearance[ai.z + ${q}u] + a.weight.w * planes_appearance[ai.w + ${q}u];
        f[${q+4}] += b.weight.x * planes_appearance[bi.x + ${q}u] + b.weight.y * planes_appearance[bi.y + ${q}u]
            + b.weight.z * planes_appearance[bi.z + ${q}u] + b.weight.w * planes_appearance[bi.w + ${q}u];
#end
    }
#end
    return f;
}

// d(g . features)/d(position) [1/m].
fn lookup_appearance_gradient(p: vec3f, gradient: array<vec4f, 8>) -> vec3f {
    var g = gradient;
    var out = vec3f(0.0);
    let local = p - params.box_min.xyz;
#for level in 0..2
    {
        let inv = params.surface_inv_cell[${level}];
#if level == 0
        let grid = params.surface_coarse;
#else
        let grid = params.surface_fine;
#end
#for plane in 0..3
        {
            let a = plane_corners(${plane}u, local * inv, grid);
            let i = a.cell * 4u;
            var v = vec4f(0.0);
#for q in 0..4
            v += vec4f(dot(g[${level*4+q}], planes_appearance[i.x + ${q}u]), dot(g[${level*4+q}], planes_appearance[i.y + ${q}u]),
                dot(g[${level*4+q}], planes_appearance[i.z + ${q}u]), dot(g[${level*4+q}], planes_appearance[i.w + ${q}u]));
#end
            let du = ((v.y - v.x) * (1.0 - a.fraction.y) + (v.w - v.z) * a.fraction.y) * inv * a.inside.x;
            let dv = ((v.z - v.x) * (1.0 - a.fraction.x) + (v.w - v.y) * a.fraction.x) * inv * a.inside.y;
#if plane == 0
            out += vec3f(du, dv, 0.0);
#end
#if plane == 1
            out += vec3f(du, 0.0, dv);
#end
#if plane == 2
            out += vec3f(0.0, du, dv);
#end
        }
#end
    }
#end
    return out;
}
