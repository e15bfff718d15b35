//! A scene: its solids, paints, light and classes, and what a ray sees of them.
use super::{
    SceneKind,
    bvh::{Bvh, Hit},
    furniture,
    light::{Light, LightMaps},
    math::{Rng, hash, sin_cos},
    shape::{Primitive, Shape},
    texture::{Material, Pattern},
    trajectory::Path,
};
use alloc::{string::ToString, vec, vec::Vec};
use glam::{Mat3, Vec3};
use mte_slam_types::classes::{Class, ClassTable};

macro_rules! classes {
    ($($id:ident = $raw:literal $color:expr;)*) => {
        /// Compact class indices.
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Kind { $($id),* }
        const TABLE: &[(u16, &str, [u8; 3])] = &[$(($raw, stringify!($id), $color)),*];
    };
}

// Raw ids have gaps and no order, as those of real data sets.
classes! {
    wall = 93 [174, 199, 232];
    floor = 40 [152, 118, 84];
    ceiling = 31 [225, 225, 200];
    window = 97 [60, 190, 230];
    door = 37 [214, 100, 40];
    table = 80 [255, 152, 150];
    chair = 20 [188, 189, 34];
    sofa = 76 [140, 86, 175];
    shelf = 71 [120, 85, 60];
    book = 7 [44, 160, 44];
    lamp = 47 [255, 220, 50];
    vase = 91 [227, 60, 160];
    cup = 14 [0, 60, 255];
    picture = 59 [23, 110, 200];
    rug = 98 [200, 30, 45];
    cushion = 29 [255, 127, 14];
    plant = 44 [20, 100, 40];
    monitor = 87 [60, 60, 75];
    cabinet = 15 [90, 200, 160];
    curtain = 30 [240, 170, 230];
}

/// The class table that all built-in scenes share.
pub fn class_table() -> ClassTable {
    let class = |&(raw_id, name, color): &(u16, &str, [u8; 3])| Class {
        raw_id,
        name: name.to_string(),
        color,
    };
    ClassTable { classes: TABLE.iter().map(class).collect() }
}

/// The room's shell, seen from inside.
#[derive(Clone, Debug)]
pub struct Room {
    /// A box whose faces are the walls, the floor and the ceiling.
    pub shell: Primitive,
}

/// Collects solids and paints; positions are relative to the current placement.
pub struct Builder {
    /// Random numbers of the seed.
    pub rng: Rng,
    /// Solids so far.
    pub primitives: Vec<Primitive>,
    materials: Vec<Material>,
    /// Lights so far.
    pub lights: Vec<Light>,
    origin: Vec3,
    turn: Mat3,
}

/// A linear colour from an sRGB one (with the gamma of 2 that the renderer uses).
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
    /// Following solids stand at `origin`, turned by `degrees` about z.
    pub fn place(&mut self, origin: [f32; 3], degrees: f32) {
        self.origin = Vec3::from(origin);
        self.turn = yaw(degrees);
    }

    /// A position of the current placement in the world.
    pub fn world(&self, p: [f32; 3]) -> Vec3 {
        self.origin + self.turn * Vec3::from(p)
    }

    /// A direction of the current placement in the world.
    pub fn world_direction(&self, d: Vec3) -> Vec3 {
        self.turn * d
    }

    /// A new paint from sRGB colours.
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

    /// Make a paint give off light.
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
        });
        let last = self.primitives.len() - 1;
        &mut self.primitives[last]
    }

    /// A box from its smallest corner to its largest.
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

/// Everything that is built once for a sequence.
pub struct Scene {
    /// The shell.
    pub room: Room,
    /// The solids in it.
    pub primitives: Vec<Primitive>,
    /// The camera's path.
    pub path: Path,
    materials: Vec<Material>,
    bvh: Bvh,
    light: LightMaps,
}

impl Scene {
    /// Build a scene; the seed changes paints, small things and the hand's shake, not the layout.
    pub fn new(kind: SceneKind, seed: u64) -> Scene {
        let mut b = Builder {
            rng: Rng::new(
                seed ^ match kind {
                    SceneKind::Room => 0,
                    SceneKind::Office => 0x0FF1_CE00,
                    #[cfg(feature = "hall")]
                    SceneKind::Hall => 0x4A11_0000,
                },
            ),
            primitives: Vec::new(),
            materials: Vec::new(),
            lights: Vec::new(),
            origin: Vec3::ZERO,
            turn: Mat3::IDENTITY,
        };
        let (shell, waypoints) = match kind {
            SceneKind::Room => furniture::room::build(&mut b),
            SceneKind::Office => furniture::office::build(&mut b),
            #[cfg(feature = "hall")]
            SceneKind::Hall => furniture::hall::build(&mut b),
        };
        let room = Room { shell };
        let path = Path::new(&waypoints, b.rng.next());
        let bvh = Bvh::new(&b.primitives);
        let ambient = Vec3::splat(0.50);
        let light = LightMaps::bake(&room, &b.primitives, &bvh, &b.lights, ambient);
        Scene { room, primitives: b.primitives, path, materials: b.materials, bvh, light }
    }

    /// The surface that a ray from inside the room sees.
    pub fn trace(&self, o: Vec3, d: Vec3) -> Hit {
        let wall = self.shell_hit(o, d);
        self.bvh.nearest(&self.primitives, o, d, wall.t).unwrap_or(wall)
    }

    /// The hit of a ray with one solid (or the shell), if it is not missed.
    pub fn retrace(&self, primitive: u32, o: Vec3, d: Vec3) -> Option<Hit> {
        let Some(solid) = self.primitives.get(primitive as usize) else {
            return Some(self.shell_hit(o, d));
        };
        let (t, face) = solid.intersect(o, d, 1e-4, f32::MAX)?;
        Some(Hit { t, primitive, face })
    }

    fn shell_hit(&self, o: Vec3, d: Vec3) -> Hit {
        let shell = &self.room.shell;
        let t = (shell.half.copysign(d) - (o - shell.centre)) * d.recip();
        let (mut best, mut axis) = (t.x, 0);
        if t.y < best {
            (best, axis) = (t.y, 1);
        }
        if t.z < best {
            (best, axis) = (t.z, 2);
        }
        let face = (2 * axis + usize::from(d[axis] > 0.0)) as u8;
        Hit { t: best, primitive: self.primitives.len() as u32, face }
    }

    /// The solid (or the shell) with this number.
    pub fn solid(&self, primitive: u32) -> &Primitive {
        self.primitives.get(primitive as usize).unwrap_or(&self.room.shell)
    }

    /// Compact class of a hit.
    pub fn class(&self, hit: &Hit) -> u8 {
        self.solid(hit.primitive).class[hit.face as usize]
    }

    /// Surface normal of a hit, towards the viewer's side.
    pub fn normal(&self, hit: &Hit, p: Vec3) -> Vec3 {
        let solid = self.solid(hit.primitive);
        let n = solid.normal(hit.face, solid.to_local(p));
        if hit.primitive as usize == self.primitives.len() { -n } else { n }
    }

    /// Reflected light (linear, display range) at a world point of a face, averaged over about
    /// `footprint` metres.
    pub fn radiance(&self, primitive: u32, face: u8, p: Vec3, footprint: f32) -> Vec3 {
        let solid = self.solid(primitive);
        let chart = solid.chart(face, solid.to_local(p));
        let mut paint = self.materials[solid.material[face as usize] as usize];
        paint.seed = hash(paint.seed ^ (primitive * 8 + u32::from(face)));
        let (s, t) = ((2.0 * chart.a - 1.0) * chart.half[0], (2.0 * chart.b - 1.0) * chart.half[1]);
        let albedo = paint.albedo(s, t, chart.half, footprint).max(Vec3::ZERO);
        let light = self.light.sample(primitive, face, &chart, solid.shape);
        let c = albedo * (light + paint.glow);
        // A soft shoulder instead of clipping where a lamp shines.
        c * 1.10 / (Vec3::ONE + 0.18 * c)
    }

    /// All solids with their numbers, the shell last.
    pub fn solids(&self) -> Vec<(u32, &Primitive)> {
        let mut all: Vec<_> =
            self.primitives.iter().enumerate().map(|(i, p)| (i as u32, p)).collect();
        all.push((self.primitives.len() as u32, &self.room.shell));
        all
    }

    /// Whether a world point is inside a solid or outside the room.
    pub fn buried(&self, p: Vec3) -> bool {
        !self.room.shell.contains(p) || self.primitives.iter().any(|s| s.contains(p))
    }
}

/// The shell of a room of this size centred on the origin, standing on z = 0.
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
    }
}

/// A lamp that shines all around from a shell of points.
pub fn bulb(centre: Vec3, radius: f32, power: Vec3) -> Light {
    let mut points = vec![];
    for i in 0..8u8 {
        let sign = |bit: u8| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        points.push(centre + radius * 0.577 * Vec3::new(sign(0), sign(1), sign(2)));
    }
    Light { points, facing: Vec3::ZERO, power }
}
