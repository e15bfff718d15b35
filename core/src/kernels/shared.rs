//! Twins of the imported shader parts (`shaders/shared/*.wgsl`): rays, random numbers, planes,
//! decoders, interval weights. Same formulas in the same order; summation order may differ.
pub use mte_slam_shaders::rays::{
    FLAG_ANCHORS, FLAG_DENSE, FLAG_GUIDED, FLAG_MAP, FLAG_MASK, FLAG_POSE, RAY_MASKED, RAY_WORDS,
    Ray,
};

use crate::layout::{FieldParams, GEOMETRY_FLOATS, HEAD_FLOATS, SURFACE_FLOATS};
use mte_slam_shaders::decoders::{COLOR, GEOMETRY, Layer, SEMANTIC};

/// Three floats.
pub type Vec3 = [f32; 3];
/// Features of one modality at a point: 16 coarse, 16 fine channels.
pub type Features = [f32; 32];

/// Sine and cosine of an angle \[rad\] of up to some hundreds, to 1e-6 of 1, by the polynomials of
/// `shaders/shared/angle.wgsl`: WGSL's own functions may be off by 2^-11.
pub fn sin_cos(angle: f32) -> [f32; 2] {
    let quarters = libm::floorf(angle * core::f32::consts::FRAC_2_PI + 0.5);
    let r = ((angle - quarters * 1.570_312_5) - quarters * 4.837_513e-4) - quarters * 7.549_79e-8;
    let z = r * r;
    let s = r + r * z * (-0.166_666_55 + z * (8.332_161e-3 - z * 1.951_529_6e-4));
    let c = 1.0 - 0.5 * z + z * z * (4.166_664_6e-2 + z * (-1.388_731_6e-3 + z * 2.443_315_7e-5));
    match quarters as i32 & 3 {
        0 => [s, c],
        1 => [c, -s],
        2 => [-s, -c],
        _ => [-c, s],
    }
}

/// PCG output hash.
pub fn pcg(v: u32) -> u32 {
    let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Random bits for a key.
pub fn random_u32(seed: u32, iteration: u32, index: u32, salt: u32) -> u32 {
    pcg(pcg(pcg(pcg(seed) ^ iteration) ^ index) ^ salt)
}

/// Uniform in \[0, 1), 24 bits.
pub fn random_f32(seed: u32, iteration: u32, index: u32, salt: u32) -> f32 {
    (random_u32(seed, iteration, index, salt) >> 8) as f32 * 5.960_464_5e-8
}

/// The four cells around a position on a plane.
#[derive(Clone, Copy, Debug)]
pub struct Corners {
    /// Cell indices.
    pub cell: [usize; 4],
    /// Bilinear weights.
    pub weight: [f32; 4],
    /// Position inside the cell.
    pub fraction: [f32; 2],
    /// 0 where the position was clamped to the edge.
    pub inside: [f32; 2],
}

fn corners(u: f32, v: f32, nu: u32, nv: u32, base: u32) -> Corners {
    let (cu, cv) = (u.max(0.0).min((nu - 1) as f32), v.max(0.0).min((nv - 1) as f32));
    let (iu, iv) = ((cu as u32).min(nu - 2), (cv as u32).min(nv - 2));
    let (fu, fv) = (cu - iu as f32, cv - iv as f32);
    let first = (base + iv * nu + iu) as usize;
    let nu = nu as usize;
    Corners {
        cell: [first, first + 1, first + nu, first + nu + 1],
        weight: [(1.0 - fu) * (1.0 - fv), fu * (1.0 - fv), (1.0 - fu) * fv, fu * fv],
        fraction: [fu, fv],
        inside: [f32::from(u8::from(cu == u)), f32::from(u8::from(cv == v))],
    }
}

/// Corners of plane 0 (xy), 1 (xz) or 2 (yz) of a level at grid position `g`.
pub fn plane_corners(plane: usize, g: Vec3, level: [u32; 4]) -> Corners {
    let [nx, ny, nz, base] = level;
    match plane {
        0 => corners(g[0], g[1], nx, ny, base),
        1 => corners(g[0], g[2], nx, nz, base + nx * ny),
        _ => corners(g[1], g[2], ny, nz, base + nx * (ny + nz)),
    }
}

/// Axes of the three planes.
pub const PLANE_AXES: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// The grid of one kind of planes.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Smallest corner \[m\].
    pub min: Vec3,
    /// Coarse and fine level: nx, ny, nz, first cell.
    pub levels: [[u32; 4]; 2],
    /// 1 / cell of both levels \[1/m\].
    pub inv_cell: [f32; 2],
}

impl Grid {
    /// The geometry planes.
    pub fn geometry(p: &FieldParams) -> Grid {
        Grid {
            min: [p.box_min[0], p.box_min[1], p.box_min[2]],
            levels: [p.geometry_coarse, p.geometry_fine],
            inv_cell: [p.geometry_inv_cell[0], p.geometry_inv_cell[1]],
        }
    }

    /// The appearance and semantic planes.
    pub fn surface(p: &FieldParams) -> Grid {
        Grid {
            min: [p.box_min[0], p.box_min[1], p.box_min[2]],
            levels: [p.surface_coarse, p.surface_fine],
            inv_cell: [p.surface_inv_cell[0], p.surface_inv_cell[1]],
        }
    }

    /// Grid coordinates of a point on a level.
    pub fn local(&self, p: Vec3, level: usize) -> Vec3 {
        let k = self.inv_cell[level];
        [(p[0] - self.min[0]) * k, (p[1] - self.min[1]) * k, (p[2] - self.min[2]) * k]
    }

    /// Features at a point.
    pub fn lookup(&self, planes: &[f32], p: Vec3) -> Features {
        let mut f = [0.0; 32];
        for level in 0..2 {
            let g = self.local(p, level);
            let out = &mut f[level * 16..level * 16 + 16];
            for plane in 0..3 {
                let c = plane_corners(plane, g, self.levels[level]);
                let cell = |i: usize| &planes[c.cell[i] * 16..c.cell[i] * 16 + 16];
                let (v0, v1, v2, v3) = (cell(0), cell(1), cell(2), cell(3));
                for k in 0..16 {
                    out[k] += c.weight[0] * v0[k]
                        + c.weight[1] * v1[k]
                        + c.weight[2] * v2[k]
                        + c.weight[3] * v3[k];
                }
            }
        }
        f
    }

    /// d(gradient . features)/d(position) \[1/m\].
    pub fn lookup_gradient(&self, planes: &[f32], p: Vec3, gradient: &Features) -> Vec3 {
        let mut out = [0.0; 3];
        for level in 0..2 {
            let g = self.local(p, level);
            let inv = self.inv_cell[level];
            let d = &gradient[level * 16..level * 16 + 16];
            for plane in 0..3 {
                let c = plane_corners(plane, g, self.levels[level]);
                let v: [f32; 4] = core::array::from_fn(|i| {
                    let cell = &planes[c.cell[i] * 16..c.cell[i] * 16 + 16];
                    (0..16).map(|k| d[k] * cell[k]).sum()
                });
                let (fu, fv) = (c.fraction[0], c.fraction[1]);
                let du = ((v[1] - v[0]) * (1.0 - fv) + (v[3] - v[2]) * fv) * inv * c.inside[0];
                let dv = ((v[2] - v[0]) * (1.0 - fu) + (v[3] - v[1]) * fu) * inv * c.inside[1];
                let (au, av) = PLANE_AXES[plane];
                out[au] += du;
                out[av] += dv;
            }
        }
        out
    }
}

/// o = b + W^T x with W stored input-major (`w[k * O + j]`), b behind it.
fn dense<const I: usize, const O: usize>(w: &[f32], x: &[f32; I]) -> [f32; O] {
    let (w, b) = w.split_at(I * O);
    let mut o = [0.0; O];
    o.copy_from_slice(&b[..O]);
    for k in 0..I {
        let row = &w[k * O..k * O + O];
        for j in 0..O {
            o[j] += row[j] * x[k];
        }
    }
    o
}

/// W d: gradient at a layer's inputs.
fn dense_back<const I: usize, const O: usize>(w: &[f32], d: &[f32; O]) -> [f32; I] {
    core::array::from_fn(|k| {
        let row = &w[k * O..k * O + O];
        (0..O).map(|j| row[j] * d[j]).sum()
    })
}

fn relu<const N: usize>(mut x: [f32; N]) -> [f32; N] {
    for v in &mut x {
        *v = v.max(0.0);
    }
    x
}

fn mask<const N: usize>(mut d: [f32; N], h: &[f32; N]) -> [f32; N] {
    for k in 0..N {
        if h[k] <= 0.0 {
            d[k] = 0.0;
        }
    }
    d
}

/// Activations of the geometry decoder.
#[derive(Clone, Copy, Debug)]
pub struct GeometryState {
    /// After the first layer.
    pub h1: [f32; 16],
    /// After the second layer.
    pub h2: [f32; 16],
    /// Signed distance \[truncations\].
    pub distance: f32,
}

/// Gradients at the pre-activations of the geometry decoder.
#[derive(Clone, Copy, Debug)]
pub struct GeometryDeltas {
    /// First layer.
    pub d1: [f32; 16],
    /// Second layer.
    pub d2: [f32; 16],
    /// Output.
    pub d3: f32,
}

/// Geometry decoder 32-16-16-1, tanh. `w`: the decoder buffer.
pub fn geometry_decoder(w: &[f32], f: &Features) -> GeometryState {
    let [first, second, last] = GEOMETRY;
    let h1 = relu(dense::<32, 16>(&w[first.weights..second.weights], f));
    let h2 = relu(dense::<16, 16>(&w[second.weights..last.weights], &h1));
    let o: f32 = w[last.bias] + (0..16).map(|k| w[last.weights + k] * h2[k]).sum::<f32>();
    GeometryState { h1, h2, distance: libm::tanhf(o) }
}

/// Deltas for dL/d(distance) = `g`.
pub fn geometry_deltas(w: &[f32], s: &GeometryState, g: f32) -> GeometryDeltas {
    let d3 = g * (1.0 - s.distance * s.distance);
    let d2 = mask(core::array::from_fn(|k| w[GEOMETRY[2].weights + k] * d3), &s.h2);
    let d1 = mask(dense_back::<16, 16>(&w[GEOMETRY[1].weights..], &d2), &s.h1);
    GeometryDeltas { d1, d2, d3 }
}

/// dL/d(features) from the deltas.
pub fn geometry_feature_gradient(w: &[f32], d: &GeometryDeltas) -> Features {
    dense_back::<32, 16>(w, &d.d1)
}

/// The part of the decoder buffer that holds the color and semantic decoders.
pub fn surface_weights(decoders: &[f32]) -> &[f32] {
    &decoders[GEOMETRY_FLOATS..GEOMETRY_FLOATS + SURFACE_FLOATS]
}

/// A layer within [`surface_weights`].
fn within(w: &[f32], layer: Layer) -> &[f32] {
    &w[layer.weights - GEOMETRY_FLOATS..]
}

/// Hidden layer of the color decoder. `w`: [`surface_weights`].
pub fn color_hidden(w: &[f32], f: &Features) -> [f32; 32] {
    relu(dense::<32, 32>(w, f))
}

/// sRGB in 0..1.
pub fn color_output(w: &[f32], h: &[f32; 32]) -> Vec3 {
    let o = dense::<32, 4>(within(w, COLOR[1]), h);
    core::array::from_fn(|k| 1.0 / (1.0 + libm::expf(-o[k])))
}

/// From the gradient at the color's pre-activation to (hidden deltas, feature gradient).
pub fn color_backward(w: &[f32], h: &[f32; 32], d: &[f32; 4]) -> ([f32; 32], Features) {
    let dh = mask(dense_back::<32, 4>(within(w, COLOR[1]), d), h);
    (dh, dense_back::<32, 32>(w, &dh))
}

/// Hidden layer of the semantic decoder.
pub fn semantic_hidden(w: &[f32], f: &Features) -> [f32; 32] {
    relu(dense::<32, 32>(within(w, SEMANTIC[0]), f))
}

/// The semantic feature.
pub fn semantic_output(w: &[f32], h: &[f32; 32]) -> [f32; 16] {
    dense::<32, 16>(within(w, SEMANTIC[1]), h)
}

/// From the gradient at the semantic feature to (hidden deltas, plane feature gradient).
pub fn semantic_backward(w: &[f32], h: &[f32; 32], d: &[f32; 16]) -> ([f32; 32], Features) {
    let dh = mask(dense_back::<32, 16>(within(w, SEMANTIC[1]), d), h);
    (dh, dense_back::<32, 32>(within(w, SEMANTIC[0]), &dh))
}

/// Weights of class `c` in the head.
pub fn head_row(decoders: &[f32], c: u32) -> &[f32] {
    let i = HEAD_FLOATS + c as usize * 16;
    &decoders[i..i + 16]
}

/// Class logit of a semantic feature.
pub fn class_logit(decoders: &[f32], feature: &[f32; 16], classes: u32, c: u32) -> f32 {
    let row = head_row(decoders, c);
    (0..16).map(|k| row[k] * feature[k]).sum::<f32>()
        + decoders[HEAD_FLOATS + classes as usize * 16 + c as usize]
}

/// The class of the largest logit; 255 without classes.
pub fn likeliest_class(decoders: &[f32], feature: &[f32; 16], classes: u32) -> u32 {
    let (mut best, mut class) = (-1e30, 255);
    for c in 0..classes {
        let logit = class_logit(decoders, feature, classes, c);
        if logit > best {
            (best, class) = (logit, c);
        }
    }
    class
}

/// Light let through at a signed distance \[truncations\].
pub fn phi(sharpness: f32, s: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-sharpness * s))
}

/// Opacity of the interval between two samples.
pub fn interval_alpha(phi0: f32, phi1: f32) -> f32 {
    (1.0 - phi1 / phi0.max(1e-12)).clamp(0.0, 1.0)
}

/// a x b.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
