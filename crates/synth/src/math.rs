//! Hashes, noise and the few functions whose library versions differ between platforms.
//!
//! Only IEEE-exact operations (+, -, *, /, sqrt, casts) are used, so that a sequence has the same
//! bytes everywhere.
use glam::Vec3;

pub use mte_slam_types::maths::pcg as hash;

/// Hash of a lattice cell.
pub fn hash2(x: i32, y: i32, seed: u32) -> u32 {
    hash((x as u32).wrapping_mul(0x9E37_79B1) ^ hash((y as u32) ^ seed))
}

/// Returns a hash as a number in [0, 1).
pub fn unit(h: u32) -> f32 {
    (h >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Floor without a call into the maths library (slow without SSE 4.1).
pub fn floor(x: f32) -> i32 {
    let i = x as i32;
    i - i32::from(x < i as f32)
}

/// x - floor(x).
pub fn fract(x: f32) -> f32 {
    x - floor(x) as f32
}

/// Linear blend, `k` clamped to [0, 1].
pub fn mix(a: Vec3, b: Vec3, k: f32) -> Vec3 {
    a + (b - a) * k.clamp(0.0, 1.0)
}

/// Returns value noise in [-1, 1] on a unit lattice.
pub fn noise(x: f32, y: f32, seed: u32) -> f32 {
    let (i, j) = (floor(x), floor(y));
    let (u, v) = (x - i as f32, y - j as f32);
    let (u, v) = (u * u * (3.0 - 2.0 * u), v * v * (3.0 - 2.0 * v));
    let at =
        |di: i32, dj: i32| unit(hash2(i.wrapping_add(di), j.wrapping_add(dj), seed)) * 2.0 - 1.0;
    let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
    let (p, q) = (a + (b - a) * u, c + (d - c) * u);
    p + (q - p) * v
}

/// Fractal noise, about [-1, 1]. `frequency` is that of the first octave \[1/m\]; octaves finer
/// than two samples of `footprint` \[m\] fade out, so that images are not aliased.
pub fn fbm(s: f32, t: f32, frequency: f32, octaves: u32, footprint: f32, seed: u32) -> f32 {
    let (mut f, mut amplitude, mut sum) = (frequency, 0.6, 0.0);
    for octave in 0..octaves {
        let keep = (1.5 - 2.0 * f * footprint).clamp(0.0, 1.0);
        if keep == 0.0 {
            break;
        }
        sum += keep * amplitude * noise(s * f, t * f, seed.wrapping_add(octave * 0x51_7CC1));
        f *= 2.03;
        amplitude *= 0.58;
    }
    sum
}

/// Sine and cosine by Taylor series after reduction to one octant; error below 1e-12 for
/// |x| < 1e4.
pub fn sin_cos(x: f64) -> (f64, f64) {
    let quarter = x * core::f64::consts::FRAC_2_PI;
    let k = (quarter + if quarter < 0.0 { -0.5 } else { 0.5 }) as i64;
    let r = x - k as f64 * core::f64::consts::FRAC_PI_2;
    let q = r * r;
    let (mut s, mut c, mut ts, mut tc) = (r, 1.0, r, 1.0);
    for n in 1..9 {
        let m = f64::from(2 * n);
        tc *= -q / ((m - 1.0) * m);
        ts *= -q / (m * (m + 1.0));
        s += ts;
        c += tc;
    }
    match k.rem_euclid(4) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Returns an angle-like number in [0, 1) of a direction in the plane, without trigonometry.
pub fn diamond(x: f32, y: f32) -> f32 {
    let sum = x.abs() + y.abs();
    if sum == 0.0 {
        return 0.0;
    }
    let f = y / sum;
    0.25 * match (x >= 0.0, y >= 0.0) {
        (true, true) => f,
        (false, _) => 2.0 - f,
        (true, false) => 4.0 + f,
    }
}

/// Returns the unit vector with this [`diamond`] number.
pub fn from_diamond(a: f32) -> (f32, f32) {
    let q = fract(a) * 4.0;
    let y = if q < 1.0 {
        q
    } else if q < 3.0 {
        2.0 - q
    } else {
        q - 4.0
    };
    let x = if (1.0..3.0).contains(&q) { y.abs() - 1.0 } else { 1.0 - y.abs() };
    let v = glam::Vec2::new(x, y).normalize();
    (v.x, v.y)
}

/// Counter-based random numbers for building scenes.
pub struct Rng {
    seed: u32,
    counter: u32,
}

impl Rng {
    /// Starts a stream of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Rng { seed: hash(seed as u32 ^ hash((seed >> 32) as u32 ^ 0x5EED)), counter: 0 }
    }

    /// Returns the next 32 bits.
    pub fn next(&mut self) -> u32 {
        self.counter += 1;
        hash(self.seed ^ hash(self.counter))
    }

    /// Uniform in [lo, hi).
    pub fn range(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * unit(self.next())
    }

    /// One of the elements.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.next() as usize % of.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trigonometry_is_accurate() {
        for i in -400..400 {
            let x = f64::from(i) * 0.37;
            let (s, c) = sin_cos(x);
            assert!((s - x.sin()).abs() < 1e-11 && (c - x.cos()).abs() < 1e-11, "{x}");
        }
    }

    #[test]
    fn diamond_angles_round_trip() {
        for i in 0..97 {
            let a = i as f32 / 97.0;
            let (x, y) = from_diamond(a);
            assert!((diamond(x, y) - a).abs() < 1e-5, "{a}");
        }
    }
}
