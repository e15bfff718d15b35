//! Analytic primitives: oriented boxes, capped cones and ellipsoids.
use super::math::{diamond, from_diamond};
use glam::{Mat3, Vec3};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// What a primitive is, in its own frame (centred at the origin).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box of the primitive's half extents; faces 0..6 are -x, +x, -y, +y, -z, +z.
    Box,
    /// A capped cone around z, `bottom` and `top` radii \[m\], half height = half extent z;
    /// face 0 is the side, 4 the bottom, 5 the top.
    Cone {
        /// Radius at -z.
        bottom: f32,
        /// Radius at +z.
        top: f32,
    },
    /// An ellipsoid whose radii are the half extents; its only face is 0.
    Ellipsoid,
}

/// A placed, painted solid.
#[derive(Clone, Debug)]
pub struct Primitive {
    pub shape: Shape,
    pub centre: Vec3,
    /// world_from_local rotation.
    pub rotation: Mat3,
    pub half: Vec3,
    /// Material of each face.
    pub material: [u16; 6],
    /// Compact class of each face.
    pub class: [u8; 6],
    /// The thing that each face is of.
    pub object: [u32; 6],
}

/// Where a surface is, for textures and light maps.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    /// Position in [0, 1]^2 of the face.
    pub a: f32,
    /// Second coordinate.
    pub b: f32,
    /// Half the size of the face along both coordinates \[m\] (about, where it is curved).
    pub half: [f32; 2],
}

fn box_axes(face: u8) -> (usize, usize, usize) {
    match face >> 1 {
        0 => (0, 1, 2),
        1 => (1, 0, 2),
        _ => (2, 0, 1),
    }
}

impl Primitive {
    /// Number of the faces that the shape has.
    pub fn faces(&self) -> &'static [u8] {
        match self.shape {
            Shape::Box => &[0, 1, 2, 3, 4, 5],
            Shape::Cone { .. } => &[0, 4, 5],
            Shape::Ellipsoid => &[0],
        }
    }

    /// Returns the smallest and largest corner of the world-aligned bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let m = self.rotation;
        let e = m.x_axis.abs() * self.half.x
            + m.y_axis.abs() * self.half.y
            + m.z_axis.abs() * self.half.z;
        (self.centre - e, self.centre + e)
    }

    /// Returns a world point in the primitive's frame.
    pub fn to_local(&self, p: Vec3) -> Vec3 {
        let v = p - self.centre;
        Vec3::new(
            self.rotation.x_axis.dot(v),
            self.rotation.y_axis.dot(v),
            self.rotation.z_axis.dot(v),
        )
    }

    /// Entry of a ray into the solid: (ray parameter in (t_min, t_max), face).
    pub fn intersect(&self, o: Vec3, d: Vec3, t_min: f32, t_max: f32) -> Option<(f32, u8)> {
        let o = self.to_local(o);
        let d = self.to_local(d + self.centre);
        match self.shape {
            Shape::Box => {
                let inv = d.recip();
                let near = (-self.half.copysign(d) - o) * inv;
                let far = (self.half.copysign(d) - o) * inv;
                let exit = far.x.min(far.y).min(far.z);
                let (mut t, mut axis) = (near.x, 0);
                if near.y > t {
                    (t, axis) = (near.y, 1);
                }
                if near.z > t {
                    (t, axis) = (near.z, 2);
                }
                (t > t_min && t < t_max && t <= exit)
                    .then(|| (t, (2 * axis + usize::from(d[axis] < 0.0)) as u8))
            }
            Shape::Cone { bottom, top } => {
                // The origin moves to the closest approach first: otherwise c loses its digits.
                let shift = -o.dot(d) / d.length_squared();
                let o = o + d * shift;
                let h = self.half.z;
                let (mid, k) = (0.5 * (bottom + top), 0.5 * (top - bottom) / h);
                let (mut best, mut face) = (t_max, None);
                let r0 = mid + k * o.z;
                let a = d.x * d.x + d.y * d.y - k * k * d.z * d.z;
                let b = o.x * d.x + o.y * d.y - r0 * k * d.z;
                let c = o.x * o.x + o.y * o.y - r0 * r0;
                let disc = b * b - a * c;
                if disc > 0.0 && a.abs() > 1e-12 {
                    let root = disc.sqrt();
                    for q in [(-b - root) / a, (-b + root) / a] {
                        let (t, z) = (q + shift, o.z + q * d.z);
                        if t > t_min && t < best && z.abs() <= h && mid + k * z >= 0.0 {
                            (best, face) = (t, Some(0));
                        }
                    }
                }
                for (z, r, id) in [(-h, bottom, 4), (h, top, 5)] {
                    let q = (z - o.z) / d.z;
                    let t = q + shift;
                    let (x, y) = (o.x + q * d.x, o.y + q * d.y);
                    if t > t_min && t < best && x * x + y * y <= r * r {
                        (best, face) = (t, Some(id));
                    }
                }
                face.map(|f| (best, f))
            }
            Shape::Ellipsoid => {
                let inv = self.half.recip();
                let (o, d) = (o * inv, d * inv);
                let dd = d.length_squared();
                let shift = -o.dot(d) / dd;
                let gap = 1.0 - (o + d * shift).length_squared();
                if gap <= 0.0 {
                    return None;
                }
                let t = shift - (gap / dd).sqrt();
                (t > t_min && t < t_max).then_some((t, 0))
            }
        }
    }

    /// Returns whether a world point is inside the solid.
    pub fn contains(&self, p: Vec3) -> bool {
        let q = self.to_local(p);
        match self.shape {
            Shape::Box => q.abs().cmple(self.half).all(),
            Shape::Cone { bottom, top } => {
                let r = 0.5 * (bottom + top) + 0.5 * (top - bottom) * q.z / self.half.z;
                q.z.abs() <= self.half.z && q.x * q.x + q.y * q.y <= r * r
            }
            Shape::Ellipsoid => (q / self.half).length_squared() <= 1.0,
        }
    }

    /// Returns the chart of a point of a face given in the primitive's frame.
    pub fn chart(&self, face: u8, q: Vec3) -> Chart {
        let h = self.half;
        let at = |x: f32, r: f32| if r > 0.0 { 0.5 + 0.5 * x / r } else { 0.5 };
        match self.shape {
            Shape::Box => {
                let (_, i, j) = box_axes(face);
                Chart { a: at(q[i], h[i]), b: at(q[j], h[j]), half: [h[i], h[j]] }
            }
            Shape::Cone { bottom, top } => match face {
                0 => {
                    let girth = core::f32::consts::PI * 0.5 * (bottom + top);
                    Chart { a: diamond(q.x, q.y), b: at(q.z, h.z), half: [girth, h.z] }
                }
                f => {
                    let r = if f == 4 { bottom } else { top };
                    Chart { a: at(q.x, r), b: at(q.y, r), half: [r, r] }
                }
            },
            Shape::Ellipsoid => {
                let girth = core::f32::consts::PI * 0.5 * (h.x + h.y);
                Chart { a: diamond(q.x / h.x, q.y / h.y), b: at(q.z, h.z), half: [girth, h.z] }
            }
        }
    }

    /// Half the size of a face \[m\], for choosing how finely to sample it.
    pub fn face_half(&self, face: u8) -> [f32; 2] {
        self.chart(face, Vec3::ZERO).half
    }

    /// Returns the point of a face at chart position (a, b), and the outward normal, in the world.
    pub fn surface(&self, face: u8, a: f32, b: f32) -> (Vec3, Vec3) {
        let h = self.half;
        let (p, q) = (2.0 * a - 1.0, 2.0 * b - 1.0);
        let local = match self.shape {
            Shape::Box => {
                let (n, i, j) = box_axes(face);
                let mut v = Vec3::ZERO;
                v[n] = if face & 1 == 1 { h[n] } else { -h[n] };
                v[i] = p * h[i];
                v[j] = q * h[j];
                v
            }
            Shape::Cone { bottom, top } => match face {
                0 => {
                    let (x, y) = from_diamond(a);
                    let r = bottom + (top - bottom) * b;
                    Vec3::new(x * r, y * r, q * h.z)
                }
                4 => Vec3::new(p * bottom, q * bottom, -h.z),
                _ => Vec3::new(p * top, q * top, h.z),
            },
            Shape::Ellipsoid => {
                let (x, y) = from_diamond(a);
                let r = (1.0 - q * q).max(0.0).sqrt();
                Vec3::new(x * r * h.x, y * r * h.y, q * h.z)
            }
        };
        (self.centre + self.rotation * local, self.normal(face, local))
    }

    /// Outward normal in the world at a point of a face given in the primitive's frame.
    pub fn normal(&self, face: u8, q: Vec3) -> Vec3 {
        let local = match self.shape {
            Shape::Cone { bottom, top } if face == 0 => {
                let r = (q.x * q.x + q.y * q.y).sqrt().max(1e-9);
                let slope = 0.5 * (bottom - top) / self.half.z;
                Vec3::new(q.x / r, q.y / r, slope).normalize()
            }
            Shape::Ellipsoid => (q / (self.half * self.half)).normalize(),
            _ => {
                let mut n = Vec3::ZERO;
                n[(face >> 1) as usize] = if face & 1 == 1 { 1.0 } else { -1.0 };
                n
            }
        };
        self.rotation * local
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(shape: Shape, half: Vec3) -> Primitive {
        // A rotation with irrational-looking entries, from three exact reflections of axes.
        let z = Vec3::new(0.3, -0.5, 0.8).normalize();
        let x = z.cross(Vec3::Y).normalize();
        let rotation = Mat3::from_cols(x, z.cross(x), z);
        Primitive {
            shape,
            centre: Vec3::new(0.4, 1.0, -0.3),
            rotation,
            half,
            material: [0; 6],
            class: [0; 6],
            object: [0; 6],
        }
    }

    #[test]
    fn hits_lie_on_the_chart_they_name() {
        let solids = [
            placed(Shape::Box, Vec3::new(0.3, 0.2, 0.5)),
            placed(Shape::Cone { bottom: 0.3, top: 0.1 }, Vec3::new(0.3, 0.3, 0.4)),
            placed(Shape::Cone { bottom: 0.2, top: 0.2 }, Vec3::new(0.2, 0.2, 0.4)),
            placed(Shape::Ellipsoid, Vec3::new(0.3, 0.2, 0.5)),
        ];
        for solid in &solids {
            let mut hits = 0;
            for i in 0..400 {
                let o = Vec3::new(-2.0, (i % 20) as f32 * 0.1 - 1.0, (i / 20) as f32 * 0.1 - 1.0);
                let d = (solid.centre - o) + Vec3::new(0.0, (i % 7) as f32, (i % 5) as f32) * 0.06;
                let Some((t, face)) = solid.intersect(o, d, 0.0, 100.0) else { continue };
                hits += 1;
                let p = o + d * t;
                let chart = solid.chart(face, solid.to_local(p));
                let (q, n) = solid.surface(face, chart.a, chart.b);
                assert!((p - q).length() < 2e-4, "{:?} face {face}: {p} {q}", solid.shape);
                assert!(n.dot(d) < 1e-3, "normal faces the ray");
                assert!(solid.contains(p - n * 1e-3) && !solid.contains(p + n * 1e-3));
            }
            assert!(hits > 100, "{:?} {hits}", solid.shape);
        }
    }
}
