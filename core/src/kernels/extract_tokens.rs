//! Raw features of each patch of an image: geometry, colors, class histogram.
use super::{
    shared::{Vec3, cross, sin_cos},
    tokens::{BANDS, RAW_GEOMETRY, RAW_HISTOGRAM, RAW_MEAN, RAW_PATCH, RAW_POINT, TokenParams},
};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

kernel! { pub static EXTRACT_TOKENS = mte_slam_shaders::kernels::extract_tokens, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views { poses, color_images: colors, depth_images: depths, raw } = dispatch.views();
    let pixels = p.width * p.height;
    let pose = &poses[p.slot as usize * 12..p.slot as usize * 12 + 12];
    let color = |u: u32, v: u32| colors[(p.slot * pixels + v * p.width + u) as usize];
    let depth = |u: u32, v: u32| {
        let pixel = v * p.width + u;
        let word = depths[(p.slot * pixels.div_ceil(2) + pixel / 2) as usize];
        ((word >> (16 * (pixel & 1))) & 0xffff) as f32 * p.depth_unit
    };
    let point = |u: u32, v: u32| -> Vec3 {
        let z = depth(u, v);
        [(u as f32 - p.cx) / p.fx * z, (v as f32 - p.cy) / p.fy * z, z]
    };
    let rotate = |d: Vec3| -> Vec3 {
        let row = |i: usize| pose[i] * d[0] + pose[i + 1] * d[1] + pose[i + 2] * d[2];
        [row(0), row(3), row(6)]
    };
    dispatch.for_each_invocation(|token| {
        if token >= p.tokens() {
            return;
        }
        let out = &raw[token * p.raw_stride as usize..(token + 1) * p.raw_stride as usize];
        let put = |at: u32, v: f32| store_f32(&out[at as usize], v);
        let (u0, v0) = (token as u32 % p.columns * p.size, token as u32 / p.columns * p.size);

        // The measured pixel closest to the middle stands for the patch's geometry.
        let step = p.size / 8;
        let (mut nearest, mut at) = (1000.0, (0, 0));
        let mut mean = [0.0_f32; 3];
        for k in 0..64 {
            let (i, j) = (k % 8, k / 8);
            let (u, v) = (u0 + i * step, v0 + j * step);
            let (x, y) = (i as f32 - 3.5, j as f32 - 3.5);
            let away = x * x + y * y;
            if depth(u, v) > 0.0 && away < nearest {
                (nearest, at) = (away, (u, v));
            }
            let c = color(u, v);
            for channel in 0..3 {
                let value = ((c >> (8 * channel)) & 255) as f32 / 255.0;
                put(RAW_PATCH + k * 3 + channel, value - 0.5);
                mean[channel as usize] += value / 64.0;
            }
        }
        (0..3).for_each(|k| put(RAW_MEAN + k as u32, mean[k]));
        let valid = nearest < 1000.0;
        put(RAW_MEAN + 3, 0.0);
        for k in 0..3 {
            put(RAW_POINT + k, 0.0);
        }
        put(RAW_POINT + 3, if valid { 1.0 } else { 0.0 });
        for k in 0..RAW_PATCH {
            put(RAW_GEOMETRY + k, 0.0);
        }
        if valid {
            let (u, v) = at;
            let q = rotate(point(u, v));
            let world: Vec3 = core::array::from_fn(|k| q[k] + pose[9 + k] - p.box_min[k]);
            let (left, right) = (u.saturating_sub(2), (u + 2).min(p.width - 1));
            let (up, down) = (v.saturating_sub(2), (v + 2).min(p.height - 1));
            let (l, r, a, b) = (point(left, v), point(right, v), point(u, up), point(u, down));
            if l[2] > 0.0 && r[2] > 0.0 && a[2] > 0.0 && b[2] > 0.0 {
                // Up x right in image axes (y down) points towards the camera.
                let n = cross(
                    core::array::from_fn(|k| b[k] - a[k]),
                    core::array::from_fn(|k| r[k] - l[k]),
                );
                let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
                if length > 0.0 {
                    let n = rotate(n.map(|x| x / length));
                    (0..3).for_each(|k| put(RAW_GEOMETRY + k as u32, n[k]));
                }
            }
            for k in 0..3 {
                put(RAW_POINT + k as u32, q[k] + pose[9 + k]);
                put(RAW_GEOMETRY + 3 + k as u32, world[k] / 8.0 - 0.5);
                let mut angle = world[k] * (core::f32::consts::PI / 8.0);
                for band in 0..BANDS {
                    let to = RAW_GEOMETRY + 6 + band * 6 + k as u32;
                    let [sin, cos] = sin_cos(angle);
                    put(to, sin);
                    put(to + 3, cos);
                    angle *= 2.0;
                }
            }
        }

        for c in 0..p.classes.next_multiple_of(4) {
            put(RAW_HISTOGRAM + c, 0.0);
        }
        let one = 1.0 / (p.size * p.size) as f32;
        for k in 0..p.size * p.size {
            let class = color(u0 + k % p.size, v0 + k / p.size) >> 24;
            if class < p.classes {
                let cell = &out[(RAW_HISTOGRAM + class) as usize];
                store_f32(cell, load_f32(cell) + one);
            }
        }
    });
}
