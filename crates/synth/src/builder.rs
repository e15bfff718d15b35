//! What rooms are put together with: placed solids, paints and lights.
use super::{
    classes::Kind,
    light::Light,
    math::{Rng, sin_cos},
    shape::{Primitive, Shape},
    texture::{Material, Pattern},
};
use alloc::{vec, vec::Vec};
use glam::{Mat3, Vec3};

/// Collects solids and paints; positions are relative to the current placement.
pub struct Builder {
    /// Random numbers of the seed.
    pub rng: Rng,
    /// Solids so far.
    pub primitives: Vec<Primitive>,
    /// Paints so far.
    pub materials: Vec<Material>,
    /// Lights so far.
    pub lights: Vec<Light>,
    origin: Vec3,
    turn: Mat3,
    /// The thing that following solids are of, and the number of things so far.
    object: u32,
    objects: u32,
    #[cfg(feature = "varied")]
    degrees: f32,
}

/// Things that the shell of a room consists of: walls, floor and ceiling.
const SHELL_OBJECTS: [u32; 6] = [0, 0, 0, 0, 1, 2];

/// Returns a linear colour from an sRGB one (with the gamma of 2 that the renderer uses).
pub fn rgb(c: [u8; 3]) -> Vec3 {
    let v = Vec3::new(f32::from(c[0]), f32::from(c[1]), f32::from(c[2])) / 255.0;
    v * v
}

/// Rotation about z.
pub fn yaw(degrees: f32) -> Mat3 {
    let (s, c) = sin_cos(f64::from(degrees).to_radians());
    let (s, c) = (s as f32, c as f32);
    Mat3::from_cols(Vec3::new(c, s, 0.0), Vec3::new(-s, c, 0.0), Vec3::Z)
}

/// Rotation about x.
pub fn pitch(degrees: f32) -> Mat3 {
    let (s, c) = sin_cos(f64::from(degrees).to_radians());
    let (s, c) = (s as f32, c as f32);
    Mat3::from_cols(Vec3::X, Vec3::new(0.0, c, s), Vec3::new(0.0, -s, c))
}

impl Builder {
    /// Starts with nothing; paints and small things follow the seed.
    pub fn new(seed: u64) -> Builder {
        Builder {
            rng: Rng::new(seed),
            primitives: Vec::new(),
            materials: Vec::new(),
            lights: Vec::new(),
            origin: Vec3::ZERO,
            turn: Mat3::IDENTITY,
            object: 0,
            objects: 3,
            #[cfg(feature = "varied")]
            degrees: 0.0,
        }
    }

    /// Following solids are of a new thing. Returns its number, for [`Builder::go_on`].
    pub fn begin(&mut self) -> u32 {
        self.object = self.objects;
        self.objects += 1;
        self.object
    }

    /// Following solids are of a thing that was begun before.
    pub fn go_on(&mut self, object: u32) {
        self.object = object;
    }

    /// Following solids stand at `origin`, turned by `degrees` about z.
    pub fn place(&mut self, origin: [f32; 3], degrees: f32) {
        self.origin = Vec3::from(origin);
        self.turn = yaw(degrees);
        #[cfg(feature = "varied")]
        {
            self.degrees = degrees;
        }
    }

    /// Returns the current placement: where following solids stand, and their turn \[degrees\].
    #[cfg(feature = "varied")]
    pub fn placement(&self) -> (Vec3, f32) {
        (self.origin, self.degrees)
    }

    /// Returns a position of the current placement in the world.
    pub fn world(&self, p: [f32; 3]) -> Vec3 {
        self.origin + self.turn * Vec3::from(p)
    }

    /// Returns a direction of the current placement in the world.
    pub fn world_direction(&self, d: Vec3) -> Vec3 {
        self.turn * d
    }

    /// Returns a new paint from sRGB colours.
    pub fn paint(&mut self, pattern: Pattern, a: [u8; 3], b: [u8; 3], scale: f32) -> u16 {
        let seed = self.rng.next();
        self.materials.push(Material { pattern, a: rgb(a), b: rgb(b), scale, seed, glow: 0.0 });
        (self.materials.len() - 1) as u16
    }

    /// A plain paint that gives off light.
    pub fn glowing(&mut self, a: [u8; 3], glow: f32) -> u16 {
        let id = self.paint(Pattern::Stripes, a, a, 30.0);
        self.materials[id as usize].glow = glow;
        id
    }

    /// Makes a paint give off light.
    pub fn set_glow(&mut self, paint: u16, glow: f32) {
        self.materials[paint as usize].glow = glow;
    }

    fn push(
        &mut self,
        kind: Kind,
        paint: u16,
        shape: Shape,
        c: Vec3,
        half: Vec3,
        turn: Mat3,
    ) -> &mut Primitive {
        self.primitives.push(Primitive {
            shape,
            centre: self.origin + self.turn * c,
            rotation: self.turn * turn,
            half,
            material: [paint; 6],
            class: [kind as u8; 6],
            object: [self.object; 6],
        });
        let last = self.primitives.len() - 1;
        &mut self.primitives[last]
    }

    /// Adds a box from its smallest corner to its largest.
    pub fn block(&mut self, kind: Kind, paint: u16, lo: [f32; 3], hi: [f32; 3]) -> &mut Primitive {
        let (lo, hi) = (Vec3::from(lo), Vec3::from(hi));
        self.push(kind, paint, Shape::Box, 0.5 * (lo + hi), 0.5 * (hi - lo), Mat3::IDENTITY)
    }

    /// A turned box around its centre.
    pub fn tilted(
        &mut self,
        kind: Kind,
        paint: u16,
        centre: [f32; 3],
        half: [f32; 3],
        turn: Mat3,
    ) -> &mut Primitive {
        self.push(kind, paint, Shape::Box, Vec3::from(centre), Vec3::from(half), turn)
    }

    /// An upright capped cone from the centre of its bottom.
    pub fn cone(
        &mut self,
        kind: Kind,
        paint: u16,
        foot: [f32; 3],
        radii: [f32; 2],
        height: f32,
    ) -> &mut Primitive {
        let c = Vec3::from(foot) + Vec3::new(0.0, 0.0, 0.5 * height);
        self.leaning_cone(kind, paint, c.to_array(), radii, height, Mat3::IDENTITY)
    }

    /// A capped cone around its centre, its axis turned from z.
    pub fn leaning_cone(
        &mut self,
        kind: Kind,
        paint: u16,
        centre: [f32; 3],
        radii: [f32; 2],
        height: f32,
        turn: Mat3,
    ) -> &mut Primitive {
        let r = radii[0].max(radii[1]);
        let shape = Shape::Cone { bottom: radii[0], top: radii[1] };
        self.push(kind, paint, shape, Vec3::from(centre), Vec3::new(r, r, 0.5 * height), turn)
    }

    /// An ellipsoid around its centre.
    pub fn ellipsoid(
        &mut self,
        kind: Kind,
        paint: u16,
        centre: [f32; 3],
        radii: [f32; 3],
        turn: Mat3,
    ) -> &mut Primitive {
        self.push(kind, paint, Shape::Ellipsoid, Vec3::from(centre), Vec3::from(radii), turn)
    }
}

/// Returns the shell of a room of this size centred on the origin, standing on z = 0.
pub fn shell(size: [f32; 3], walls: [u16; 4], floor: u16, ceiling: u16) -> Primitive {
    let wall = Kind::wall as u8;
    let half = 0.5 * Vec3::from(size);
    Primitive {
        shape: Shape::Box,
        centre: Vec3::new(0.0, 0.0, half.z),
        rotation: Mat3::IDENTITY,
        half,
        material: [walls[0], walls[1], walls[2], walls[3], floor, ceiling],
        class: [wall, wall, wall, wall, Kind::floor as u8, Kind::ceiling as u8],
        object: SHELL_OBJECTS,
    }
}

/// Returns a lamp that shines all around from a shell of points.
pub fn bulb(centre: Vec3, radius: f32, power: Vec3) -> Light {
    let mut points = vec![];
    for i in 0..8u8 {
        let sign = |bit: u8| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        points.push(centre + radius * 0.577 * Vec3::new(sign(0), sign(1), sign(2)));
    }
    Light { points, facing: Vec3::ZERO, power }
}
