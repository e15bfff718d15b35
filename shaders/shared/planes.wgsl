// Bilinear feature planes. A grid level is vec4<u32>(nx, ny, nz, first cell); its planes xy, xz, yz follow
// each other; a cell holds 16 channels as 4 vec4.
struct Corners {
    cell: vec4<u32>,
    weight: vec4f,
    fraction: vec2f,
    // 0 where the position was clamped to the plane's edge: no derivative there.
    inside: vec2f,
}
fn corners(uv: vec2f, nu: u32, nv: u32, base: u32) -> Corners {
    let top = vec2f(f32(nu - 1u), f32(nv - 1u));
    let c = clamp(uv, vec2f(0.0), top);
    let i = min(vec2<u32>(c), vec2<u32>(nu - 2u, nv - 2u));
    let f = c - vec2f(i);
    let first = base + i.y * nu + i.x;
    var out: Corners;
    out.cell = vec4<u32>(first, first + 1u, first + nu, first + nu + 1u);
    out.weight = vec4f((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    out.fraction = f;
    out.inside = select(vec2f(0.0), vec2f(1.0), c == uv);
    return out;
}
// Corners of plane 0 (xy), 1 (xz) or 2 (yz) of a level at grid position g = (p - box_min) / cell.
fn plane_corners(plane: u32, g: vec3f, level: vec4<u32>) -> Corners {
    if (plane == 0u) {
        return corners(g.xy, level.x, level.y, level.w);
    }
    if (plane == 1u) {
        return corners(g.xz, level.x, level.z, level.w + level.x * level.y);
    }
    return corners(g.yz, level.y, level.z, level.w + level.x * (level.y + level.z));
}
