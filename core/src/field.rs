//! The scene representation: bounds, grids, parameters and their first values.
use crate::{
    config::FieldConfig,
    frame::Bounds,
    kernels::shared::random_f32,
    layout::{CHANNELS, FieldParams, HEAD_FLOATS},
};
use alloc::{vec, vec::Vec};
use glam::DVec3;
use mte_slam_shaders::{
    decoders::{LAYERS, Layer},
    random::{first_values, salt},
};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// One resolution of a set of planes: vertices along x, y, z and the first cell.
pub type Level = [u32; 4];

/// Bounds and grids of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldShape {
    /// Box \[m\]; its edges are whole numbers of the coarsest cell.
    pub bounds: Bounds,
    /// Geometry planes, coarse and fine.
    pub geometry: [Level; 2],
    /// Appearance and semantic planes, coarse and fine.
    pub surface: [Level; 2],
    /// Cells of geometry and surface planes \[m\].
    cells_m: [[f64; 2]; 2],
}

/// Cells of the three planes over a grid. Saturates: a box that no map can hold, which a file or a
/// unit of depth may well ask for, must have a size that every engine refuses.
fn plane_cells([nx, ny, nz]: [u32; 3]) -> u32 {
    let product = |a: u32, b: u32| u64::from(a) * u64::from(b);
    let cells = product(nx, ny).saturating_add(product(nx, nz)).saturating_add(product(ny, nz));
    u32::try_from(cells).unwrap_or(u32::MAX)
}

fn levels(extent_m: DVec3, cells_m: [f64; 2]) -> [Level; 2] {
    let mut first = 0u32;
    cells_m.map(|cell| {
        let n = |x: f64| ((x / cell).round() as u32).saturating_add(1);
        let [nx, ny, nz] = [n(extent_m.x), n(extent_m.y), n(extent_m.z)];
        let level = [nx, ny, nz, first];
        first = first.saturating_add(plane_cells([nx, ny, nz]));
        level
    })
}

fn plane_floats(levels: &[Level; 2]) -> usize {
    let [nx, ny, nz, first] = levels[1];
    (first as usize).saturating_add(plane_cells([nx, ny, nz]) as usize).saturating_mul(CHANNELS)
}

impl FieldShape {
    /// A map over at least `bounds`, rounded outwards to whole coarsest cells.
    pub fn new(bounds: Bounds, config: &FieldConfig) -> FieldShape {
        let step = config.surface_coarse_m.max(config.geometry_coarse_m);
        let extent = (bounds.max - bounds.min).max(DVec3::splat(step));
        let whole = DVec3::new(
            (extent.x / step - 1e-6).ceil(),
            (extent.y / step - 1e-6).ceil(),
            (extent.z / step - 1e-6).ceil(),
        ) * step;
        let centre = (bounds.min + bounds.max) * 0.5;
        Self::exact(Bounds { min: centre - whole * 0.5, max: centre + whole * 0.5 }, config)
    }

    /// A map over exactly `bounds`, which a former map had. `None` when it would take more than
    /// `max_floats` per set of planes.
    pub(crate) fn restored(
        bounds: Bounds,
        config: &FieldConfig,
        max_floats: usize,
    ) -> Option<FieldShape> {
        let e = bounds.max - bounds.min;
        let finest = config.geometry_fine_m.min(config.surface_fine_m);
        let n = e / finest + 2.0;
        // In floating point, where nothing overflows.
        let cells = 2.0 * (n.x * n.y + n.x * n.z + n.y * n.z);
        let held = e.cmpgt(DVec3::ZERO).all() && cells * CHANNELS as f64 <= 4.0 * max_floats as f64;
        let shape = held.then(|| Self::exact(bounds, config))?;
        (shape.surface_floats().max(shape.geometry_floats()) <= max_floats).then_some(shape)
    }

    fn exact(bounds: Bounds, config: &FieldConfig) -> FieldShape {
        let extent = bounds.max - bounds.min;
        let cells_m = [
            [config.geometry_coarse_m, config.geometry_fine_m],
            [config.surface_coarse_m, config.surface_fine_m],
        ];
        FieldShape {
            bounds,
            geometry: levels(extent, cells_m[0]),
            surface: levels(extent, cells_m[1]),
            cells_m,
        }
    }

    /// The map grown by whole coarsest cells to hold `bounds`, or `None` when it holds it already.
    pub(crate) fn grown(&self, bounds: Bounds, config: &FieldConfig) -> Option<FieldShape> {
        let step = config.surface_coarse_m.max(config.geometry_coarse_m);
        let (mut min, mut max) = (self.bounds.min, self.bounds.max);
        for k in 0..3 {
            min[k] -= ((min[k] - bounds.min[k]) / step - 1e-6).ceil().max(0.0) * step;
            max[k] += ((bounds.max[k] - max[k]) / step - 1e-6).ceil().max(0.0) * step;
        }
        let new = Self::exact(Bounds { min, max }, config);
        (new.geometry != self.geometry || new.bounds != self.bounds).then_some(new)
    }

    /// Floats of the geometry planes.
    pub fn geometry_floats(&self) -> usize {
        plane_floats(&self.geometry)
    }

    /// Floats of the appearance planes, and of the semantic ones.
    pub fn surface_floats(&self) -> usize {
        plane_floats(&self.surface)
    }

    /// Writes bounds and grids into kernel parameters.
    pub fn fill(&self, p: &mut FieldParams) {
        let v = |x: DVec3| [x.x as f32, x.y as f32, x.z as f32, 0.0];
        p.box_min = v(self.bounds.min);
        p.box_max = v(self.bounds.max);
        [p.geometry_coarse, p.geometry_fine] = self.geometry;
        [p.surface_coarse, p.surface_fine] = self.surface;
        let inv = |c: [f64; 2]| [(1.0 / c[0]) as f32, (1.0 / c[1]) as f32, 0.0, 0.0];
        p.geometry_inv_cell = inv(self.cells_m[0]);
        p.surface_inv_cell = inv(self.cells_m[1]);
    }

    /// Copies plane values of `old` into the larger `self`; new cells get `fresh` values.
    /// `surface` chooses the grid.
    pub(crate) fn carry_over(
        &self,
        old: &FieldShape,
        surface: bool,
        values: &[f32],
        fresh: &mut [f32],
    ) {
        let (from, to) =
            if surface { (&old.surface, &self.surface) } else { (&old.geometry, &self.geometry) };
        let cells = self.cells_m[usize::from(surface)];
        for level in 0..2 {
            let shift: [u32; 3] = core::array::from_fn(|k| {
                ((old.bounds.min[k] - self.bounds.min[k]) / cells[level]).round() as u32
            });
            let (mut source, mut target) = (from[level][3], to[level][3]);
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                let (ou, ov) = (from[level][a], from[level][b]);
                let (nu, nv) = (to[level][a], to[level][b]);
                for v in 0..ov {
                    let s = (source + v * ou) as usize * CHANNELS;
                    let t = (target + (v + shift[b]) * nu + shift[a]) as usize * CHANNELS;
                    let n = ou as usize * CHANNELS;
                    fresh[t..t + n].copy_from_slice(&values[s..s + n]);
                }
                source += ou * ov;
                target += nu * nv;
            }
        }
    }
}

/// Normally distributed plane features, standard deviation 0.01 (ESLAM).
pub(crate) fn initial_planes(floats: usize, seed: u32, salt: u32) -> Vec<f32> {
    (0..floats as u32)
        .map(|i| {
            // Box-Muller.
            let u = random_f32(seed, first_values::PLANE_RADIUS, i, salt).max(1e-7);
            let v = random_f32(seed, first_values::PLANE_ANGLE, i, salt);
            0.01 * (-2.0 * libm::logf(u)).sqrt() * libm::cosf(core::f32::consts::TAU * v)
        })
        .collect()
}

/// Floats of all decoders for `classes` classes.
pub fn decoder_floats(classes: u32) -> usize {
    HEAD_FLOATS + (classes as usize * 17).next_multiple_of(4).max(20)
}

/// First values of the decoders: He-uniform weights, no bias, but unseen space starts free
/// (signed distance near +0.5): it neither hides surfaces nor makes some up.
pub fn initial_decoders(classes: u32, seed: u32) -> Vec<f32> {
    let mut w = vec![0.0; decoder_floats(classes)];
    let draw =
        |at: usize| 2.0 * random_f32(seed, first_values::DECODERS, at as u32, salt::DECODERS) - 1.0;
    // The outputs of distance and color start smaller.
    let gains = [1.0, 1.0, 0.5, 1.0, 0.5, 1.0, 1.0];
    for (Layer { inputs, outputs, weights, bias }, gain) in LAYERS.into_iter().zip(gains) {
        let limit = gain * (6.0 / inputs as f32).sqrt();
        for at in weights..bias {
            w[at] = draw(at) * limit;
        }
        if outputs == 1 {
            w[bias] = 0.55;
        }
    }
    for at in HEAD_FLOATS..HEAD_FLOATS + classes as usize * 16 {
        w[at] = draw(at) * 0.4;
    }
    w
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_beyond_all_limits_have_sizes_beyond_all_limits() {
        let config = FieldConfig::default();
        let room = FieldShape::new(Bounds { min: DVec3::ZERO, max: DVec3::ONE }, &config);
        for metres in [1e4, 1e6, 1e9, 1e15, 1e30, 1e200] {
            let bounds = Bounds { min: DVec3::splat(-metres), max: DVec3::splat(metres) };
            for shape in [Some(FieldShape::new(bounds, &config)), room.grown(bounds, &config)] {
                let shape = shape.expect("a larger map");
                let floats = shape.geometry_floats().min(shape.surface_floats()) as u64;
                assert!(4 * floats > crate::engine::MAX_BUFFER_BYTES, "{metres}: {floats}");
            }
        }
    }

    #[test]
    fn growing_keeps_every_cell() {
        let config = FieldConfig::default();
        let small =
            FieldShape::new(Bounds { min: DVec3::ZERO, max: DVec3::new(1.0, 1.3, 0.9) }, &config);
        let grown = small
            .grown(Bounds { min: DVec3::splat(-0.5), max: DVec3::splat(1.2) }, &config)
            .unwrap();
        assert!(grown.grown(small.bounds, &config).is_none());
        let values: Vec<f32> = (0..small.surface_floats()).map(|i| i as f32 + 1.0).collect();
        let mut fresh = vec![0.0; grown.surface_floats()];
        grown.carry_over(&small, true, &values, &mut fresh);
        let mut kept: Vec<f32> = fresh.iter().copied().filter(|v| *v > 0.0).collect();
        kept.sort_by(f32::total_cmp);
        assert_eq!(kept, values);
        // A look-up at one world position gives the same features before and after.
        let grid = |s: &FieldShape| {
            let mut p: FieldParams = bytemuck::Zeroable::zeroed();
            s.fill(&mut p);
            crate::kernels::shared::Grid::surface(&p)
        };
        let at = [0.41, 0.77, 0.52];
        let (a, b) = (grid(&small).lookup(&values, at), grid(&grown).lookup(&fresh, at));
        for k in 0..32 {
            assert!((a[k] - b[k]).abs() < 1e-3 * a[k], "{} {}", a[k], b[k]);
        }
    }
}
