//! A scene: its solids, paints and light, and what a ray sees of them.
use super::{
    builder::Builder,
    bvh::{Hit, PrimitiveBvh},
    light::LightMaps,
    math::hash,
    options::SceneKind,
    rooms,
    shape::Primitive,
    texture::Material,
    trajectory::Path,
};
use alloc::vec::Vec;
use glam::Vec3;

/// Everything that is built once for a sequence.
pub struct Scene {
    /// A box whose faces are the walls, the floor and the ceiling, seen from inside.
    pub shell: Primitive,
    /// The solids in it.
    pub primitives: Vec<Primitive>,
    /// The camera's path.
    pub path: Path,
    materials: Vec<Material>,
    bvh: PrimitiveBvh,
    light: LightMaps,
}

impl Scene {
    /// Builds a scene; the seed changes paints, small things and the hand's shake, not the layout.
    pub fn new(kind: SceneKind, seed: u64) -> Scene {
        let mut b = Builder::new(
            seed ^ match kind {
                SceneKind::Room => 0,
                SceneKind::Office => 0x0FF1_CE00,
                #[cfg(feature = "hall")]
                SceneKind::Hall => 0x4A11_0000,
            },
        );
        let (shell, waypoints) = match kind {
            SceneKind::Room => rooms::room::build(&mut b),
            SceneKind::Office => rooms::office::build(&mut b),
            #[cfg(feature = "hall")]
            SceneKind::Hall => rooms::hall::build(&mut b),
        };
        let path = Path::new(&waypoints, b.rng.next());
        Scene::lit(b, shell, path, 0.50)
    }

    /// Puts a scene together and computes its light; `ambient` comes from everywhere.
    pub fn lit(b: Builder, shell: Primitive, path: Path, ambient: f32) -> Scene {
        let bvh = PrimitiveBvh::new(&b.primitives);
        let ambient = Vec3::splat(ambient);
        let light = LightMaps::bake(&shell, &b.primitives, &bvh, &b.lights, ambient);
        Scene { shell, primitives: b.primitives, path, materials: b.materials, bvh, light }
    }

    /// Returns the surface that a ray from inside the room sees.
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
        let shell = &self.shell;
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

    /// Returns the solid (or the shell) with this number.
    pub fn solid(&self, primitive: u32) -> &Primitive {
        self.primitives.get(primitive as usize).unwrap_or(&self.shell)
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

    /// Returns all solids with their numbers, the shell last.
    pub fn solids(&self) -> Vec<(u32, &Primitive)> {
        let mut all: Vec<_> =
            self.primitives.iter().enumerate().map(|(i, p)| (i as u32, p)).collect();
        all.push((self.primitives.len() as u32, &self.shell));
        all
    }

    /// Returns whether a world point is inside a solid or outside the room.
    pub fn buried(&self, p: Vec3) -> bool {
        !self.shell.contains(p) || self.primitives.iter().any(|s| s.contains(p))
    }
}
