// d(g . features)/d(position) of the geometry planes [1/m].
fn lookup_geometry_gradient(p: vec3f, gradient: array<vec4f, 8>) -> vec3f {
    var g = gradient;
    var out = vec3f(0.0);
    let local = p - params.box_min.xyz;
#for level in 0..2
    {
        let inv = params.geometry_inv_cell[${level}];
#if level == 0
        let grid = params.geometry_coarse;
#else
        let grid = params.geometry_fine;
#end
#for plane in 0..3
        {
            let a = plane_corners(${plane}u, local * inv, grid);
            let i = a.cell * 4u;
            var v = vec4f(0.0);
#for q in 0..4
            v += vec4f(dot(g[${level*4+q}], planes_geometry[i.x + ${q}u]), dot(g[${level*4+q}], planes_geometry[i.y + ${q}u]),
                dot(g[${level*4+q}], planes_geometry[i.z + ${q}u]), dot(g[${level*4+q}], planes_geometry[i.w + ${q}u]));
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
