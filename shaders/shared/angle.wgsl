// Sine and cosine of an angle [rad] of up to some hundreds, to 1e-6 of 1. WGSL's own may be off by 2^-11, and are in
// SwiftShader. Quadrants by Cody and Waite's three-part pi/2, polynomials of Cephes' sinf and cosf.
fn sin_cos(angle: f32) -> vec2f {
    let quarters = floor(angle * 0.63661977 + 0.5);
    let r = ((angle - quarters * 1.5703125) - quarters * 4.837512969970703e-4) - quarters * 7.549789948768648e-8;
    let z = r * r;
    let s = r + r * z * (-0.16666655 + z * (8.3321609e-3 - z * 1.9515296e-4));
    let c = 1.0 - 0.5 * z + z * z * (4.1666646e-2 + z * (-1.3887316e-3 + z * 2.4433157e-5));
    let quadrant = i32(quarters) & 3;
    let swapped = select(vec2f(s, c), vec2f(c, s), (quadrant & 1) == 1);
    return swapped * vec2f(select(1.0, -1.0, quadrant >= 2), select(1.0, -1.0, quadrant == 1 || quadrant == 2));
}
