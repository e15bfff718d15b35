//! Marching cubes in blocks. The field is evaluated by the caller, so that it can run on a device:
//! `next_block` says which grid points are due, `add_block` takes their signed distances.
use super::{
    Mesh, MeshError,
    tables::{EDGE_BASE, triangle_tables},
};
use alloc::{collections::BTreeMap, format, vec, vec::Vec};
use glam::DVec3;
use mte_slam_types::frame::Bounds;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

/// Most cells along an axis: keeps edge keys within 64 bits with room to spare.
const MAX_CELLS: f64 = 1_048_576.0;

/// A box of grid points whose signed distances are wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Position in the order of issue, from 0.
    pub sequence: u64,
    /// World position of the whole grid's first point \[m\].
    pub grid_origin: DVec3,
    /// The whole grid's spacing \[m\].
    pub grid_spacing_m: f64,
    /// Grid index of the block's first point.
    pub first: [u32; 3],
    /// Number of points along x, y, z (cells + 1; the last plane is the next block's first).
    pub dims: [u32; 3],
    /// Grid steps between neighbouring points: 1, more for a [`Block::probe`].
    pub stride: u32,
}

impl Block {
    /// Returns the number of points.
    pub fn points(&self) -> usize {
        self.dims.iter().map(|&d| d as usize).product()
    }

    /// World position of the first point \[m\].
    pub fn origin(&self) -> DVec3 {
        self.grid_origin + DVec3::from_array(self.first.map(f64::from)) * self.grid_spacing_m
    }

    /// Returns the distance between neighbouring points \[m\].
    pub fn spacing_m(&self) -> f64 {
        self.grid_spacing_m * f64::from(self.stride)
    }

    /// World position of point `i` \[m\]; x runs fastest, then y, then z. A point that several
    /// blocks share has the same bits in all of them.
    pub fn point(&self, i: usize) -> DVec3 {
        let (nx, ny) = (self.dims[0] as usize, self.dims[1] as usize);
        let local = [i % nx, i / nx % ny, i / nx / ny];
        let at = core::array::from_fn(|a| {
            f64::from(self.first[a]) + local[a] as f64 * f64::from(self.stride)
        });
        self.grid_origin + DVec3::from_array(at) * self.grid_spacing_m
    }

    /// Returns a coarser grid over the same box, with at most every `step`-th point, to find out cheaply
    /// whether a surface can be inside. It may reach past the box by less than a coarse cell.
    pub fn probe(&self, step: u32) -> Block {
        let step = step.max(1);
        let dims = self.dims.map(|d| d.saturating_sub(1).div_ceil(step) + 1);
        Block { dims, stride: self.stride * step, ..self.clone() }
    }

    /// Returns whether a surface may be inside, from the signed distances \[m\] of this (coarse) grid's
    /// points: some |distance| is below half a cell's diagonal plus `slack_m`, or the sign
    /// changes. True for a field whose gradient is at most 1; `slack_m` allows for a learned one.
    /// Unknown (non-finite) points count as surface unless all are unknown.
    pub fn may_hold_surface(&self, distances_m: &[f32], slack_m: f64) -> bool {
        let reach = self.spacing_m() * 3f64.sqrt() * 0.5 + slack_m;
        let known = distances_m.iter().filter(|d| d.is_finite()).count();
        if known < distances_m.len() {
            return known > 0;
        }
        let any_in = distances_m.iter().any(|&d| d < 0.0);
        let any_out = distances_m.iter().any(|&d| d >= 0.0);
        (any_in && any_out) || distances_m.iter().any(|&d| f64::from(d.abs()) < reach)
    }
}

/// Turns signed distances, block by block, into one welded mesh. Memory: the mesh, one block,
/// and the surface vertices on the borders of the current layer of blocks.
///
/// ```
/// # use mte_slam_types::frame::Bounds;
/// # use mte_slam_mesh::BlockMesher;
/// # use glam::DVec3;
/// let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
/// let mut mesher = BlockMesher::new(bounds, 0.05)?;
/// while let Some(block) = mesher.next_block() {
///     let sphere = |i| (block.point(i).length() - 0.7) as f32;
///     let distances: Vec<f32> = (0..block.points()).map(sphere).collect();
///     mesher.add_block(&block, &distances)?;
/// }
/// let mesh = mesher.finish();
/// assert!(!mesh.triangles.is_empty());
/// # Ok::<(), mte_slam_mesh::MeshError>(())
/// ```
pub struct BlockMesher {
    origin: DVec3,
    spacing_m: f64,
    /// Cells of the whole grid.
    cells: [u32; 3],
    block_cells: u32,
    /// Blocks of the whole grid.
    blocks: [u32; 3],
    issued: u64,
    done: u64,
    /// Vertices on block borders by global edge key (grid point * 3 + axis, z slowest).
    border: BTreeMap<u64, u32>,
    /// Distances on the borders towards later blocks, see [`BlockMesher::reconcile`].
    shared: [Vec<f32>; 3],
    /// Distances of the current block.
    distances: Vec<f32>,
    /// Vertices of the current block by local edge; kept to save allocations.
    local: Vec<u32>,
    tables: Vec<Vec<[u8; 3]>>,
    mesh: Mesh,
}

impl BlockMesher {
    /// Meshes `bounds` with cells of `resolution_m`, 32^3 cells per block.
    ///
    /// # Errors
    /// Bounds or a resolution that are not finite and positive, more than 2^20 cells an axis.
    pub fn new(bounds: Bounds, resolution_m: f64) -> Result<BlockMesher, MeshError> {
        Self::with_block_cells(bounds, resolution_m, 32)
    }

    /// As [`BlockMesher::new`] with `block_cells`^3 cells per block (1 to 256).
    ///
    /// # Errors
    /// As [`BlockMesher::new`], or a block size out of range.
    pub fn with_block_cells(
        bounds: Bounds,
        resolution_m: f64,
        block_cells: u32,
    ) -> Result<BlockMesher, MeshError> {
        let invalid = |what, found, expected: &str| {
            Err(MeshError::Invalid { what, found, expected: expected.into() })
        };
        if !(resolution_m.is_finite() && resolution_m > 0.0) {
            return invalid("mesh resolution", format!("{resolution_m} m"), "more than 0 m");
        }
        if !(1..=256).contains(&block_cells) {
            return invalid("cells per block", format!("{block_cells}"), "1 to 256");
        }
        let size = bounds.max - bounds.min;
        if !(bounds.min.is_finite() && size.is_finite() && size.min_element() > 0.0) {
            let found = format!("{:?} to {:?}", bounds.min, bounds.max);
            return invalid("mesh bounds", found, "finite, with a positive size");
        }
        // A box that is a whole number of cells up to rounding gets no extra cell.
        let cells = (size / resolution_m).to_array().map(|n| (n - 1e-6).ceil().max(1.0));
        if cells.iter().any(|&n| n > MAX_CELLS) {
            let found = format!("{cells:?} cells at {resolution_m} m");
            return invalid("mesh grid", found, "at most 1048576 cells an axis; use coarser cells");
        }
        let cells = cells.map(|n| n as u32);
        Ok(BlockMesher {
            origin: bounds.min,
            spacing_m: resolution_m,
            cells,
            block_cells,
            blocks: cells.map(|n| n.div_ceil(block_cells)),
            issued: 0,
            done: 0,
            border: BTreeMap::new(),
            shared: Default::default(),
            distances: Vec::new(),
            local: Vec::new(),
            tables: triangle_tables(),
            mesh: Mesh::default(),
        })
    }

    /// Returns the number of blocks in all.
    pub fn total_blocks(&self) -> u64 {
        self.blocks.iter().map(|&n| u64::from(n)).product()
    }

    /// Returns the number of blocks added or skipped so far.
    pub fn done_blocks(&self) -> u64 {
        self.done
    }

    /// Returns the next block, or `None` after the last. Several blocks may be out at once; they come
    /// back in the order of issue.
    pub fn next_block(&mut self) -> Option<Block> {
        if self.issued >= self.total_blocks() {
            return None;
        }
        let (bx, by) = (u64::from(self.blocks[0]), u64::from(self.blocks[1]));
        let at = [self.issued % bx, self.issued / bx % by, self.issued / bx / by];
        let first = at.map(|b| b as u32 * self.block_cells);
        let mut dims = [0; 3];
        for a in 0..3 {
            dims[a] = (self.cells[a] - first[a]).min(self.block_cells) + 1;
        }
        self.issued += 1;
        Some(Block {
            sequence: self.issued - 1,
            grid_origin: self.origin,
            grid_spacing_m: self.spacing_m,
            first,
            dims,
            stride: 1,
        })
    }

    /// Says that a block holds no surface.
    ///
    /// # Errors
    /// [`MeshError::BlockOrder`] when another block is due.
    pub fn skip_block(&mut self, block: &Block) -> Result<(), MeshError> {
        self.check_order(block)?;
        self.distances.clear();
        self.distances.resize(block.points(), f32::NAN);
        self.reconcile(block);
        self.finish_block(block);
        Ok(())
    }

    /// Meshes a block from the signed distances of its points \[m\], positive in free space, x
    /// fastest. A point with a non-finite distance is unknown: cells touching it get no triangles.
    ///
    /// # Errors
    /// [`MeshError::BlockOrder`] when another block is due; [`MeshError::Invalid`] on a wrong
    /// number of distances, or past 2^32 vertices.
    pub fn add_block(&mut self, block: &Block, distances_m: &[f32]) -> Result<(), MeshError> {
        self.check_order(block)?;
        if distances_m.len() != block.points() {
            return Err(MeshError::Invalid {
                what: "signed distances of a block",
                found: format!("{}", distances_m.len()),
                expected: format!("{}", block.points()),
            });
        }
        if self.mesh.positions.len() + 3 * block.points() > u32::MAX as usize {
            return Err(MeshError::Invalid {
                what: "vertices of the mesh",
                found: "more than 2^32".into(),
                expected: "a coarser resolution".into(),
            });
        }
        self.distances.clear();
        self.distances.extend_from_slice(distances_m);
        self.reconcile(block);
        let inside = self.distances.iter().filter(|&&d| d < 0.0).count();
        if inside > 0 && inside < self.distances.len() {
            let distances = core::mem::take(&mut self.distances);
            self.mesh_cells(block, &distances);
            self.distances = distances;
        }
        self.finish_block(block);
        Ok(())
    }

    /// Returns the mesh, with normals from its triangles and no colours or classes yet.
    pub fn finish(mut self) -> Mesh {
        self.mesh.compute_normals();
        self.mesh
    }

    fn check_order(&self, block: &Block) -> Result<(), MeshError> {
        if block.sequence != self.done || self.done >= self.issued {
            return Err(MeshError::BlockOrder { found: block.sequence, expected: self.done });
        }
        Ok(())
    }

    fn finish_block(&mut self, block: &Block) {
        self.done += 1;
        let per_layer = u64::from(self.blocks[0]) * u64::from(self.blocks[1]);
        if self.done.is_multiple_of(per_layer) {
            // The next layer shares only this one's topmost plane.
            let top = block.first[2] + block.dims[2] - 1;
            self.border = self.border.split_off(&self.edge_key([0, 0, top], 0));
        }
    }

    /// Where blocks share a point, the first known distance counts for all: a device may round the
    /// position or the sum differently in each block, and a sign that flips would be a crack.
    ///
    /// `shared[a]` holds the distances on the borders across axis a: one block's face for x, a
    /// row of blocks for y, a layer for z.
    fn reconcile(&mut self, block: &Block) {
        let side = self.block_cells as usize + 1;
        let row = self.cells[0] as usize + 1;
        if self.shared[0].is_empty() {
            let layer = row * (self.cells[1] as usize + 1);
            self.shared = [side * side, row * side, layer].map(|n| vec![f32::NAN; n]);
        }
        let [nx, ny, nz] = block.dims.map(|d| d as usize);
        let [first_x, first_y, _] = block.first.map(|i| i as usize);
        for z in 0..nz {
            for y in 0..ny {
                // Within the block only the two ends of a row can be on a border.
                let whole_row = y == 0 || z == 0 || y + 1 == ny || z + 1 == nz;
                for x in (0..nx).step_by(if whole_row { 1 } else { nx - 1 }) {
                    let at = [x, y, z];
                    let slots =
                        [z * side + y, z * row + first_x + x, (first_y + y) * row + first_x + x];
                    let mut d = self.distances[(z * ny + y) * nx + x];
                    // The first axis alone: the slots of the others may already hold what this
                    // block's neighbour wrote for the blocks to come.
                    if let Some(a) = (0..3).find(|&a| at[a] == 0 && block.first[a] > 0) {
                        let known = self.shared[a][slots[a]];
                        d = if known.is_finite() { known } else { d };
                        self.distances[(z * ny + y) * nx + x] = d;
                    }
                    for a in 0..3 {
                        if at[a] + 1 == block.dims[a] as usize {
                            self.shared[a][slots[a]] = d;
                        }
                    }
                }
            }
        }
    }

    fn edge_key(&self, point: [u32; 3], axis: usize) -> u64 {
        let [x, y, z] = point.map(u64::from);
        let (nx, ny) = (u64::from(self.cells[0]) + 1, u64::from(self.cells[1]) + 1);
        ((z * ny + y) * nx + x) * 3 + axis as u64
    }

    fn mesh_cells(&mut self, block: &Block, distances: &[f32]) {
        let [nx, ny, nz] = block.dims.map(|d| d as usize);
        self.local.clear();
        self.local.resize(3 * distances.len(), u32::MAX);
        let corner_offset: [usize; 8] =
            core::array::from_fn(|c| (c & 1) + nx * ((c >> 1 & 1) + ny * (c >> 2 & 1)));
        for z in 0..nz - 1 {
            for y in 0..ny - 1 {
                let row = (z * ny + y) * nx;
                for x in 0..nx - 1 {
                    let first = row + x;
                    let s = corner_offset.map(|o| distances[first + o]);
                    let case = (0..8).fold(0, |case, c| case | usize::from(s[c] < 0.0) << c);
                    if case == 0 || case == 255 || s.iter().any(|d| !d.is_finite()) {
                        continue;
                    }
                    let at = [x, y, z];
                    for t in 0..self.tables[case].len() {
                        let triangle = self.tables[case][t];
                        let indices = triangle.map(|e| self.vertex(block, at, first, e, &s));
                        self.mesh.triangles.push(indices);
                    }
                }
            }
        }
    }

    /// Returns the vertex on edge `e` of the cell at local point `at` (local index `first`) with corner
    /// distances `s`: the one that exists already, or a new one.
    fn vertex(&mut self, block: &Block, at: [usize; 3], first: usize, e: u8, s: &[f32; 8]) -> u32 {
        let axis = (e / 4) as usize;
        let base = EDGE_BASE[e as usize] as usize;
        let at: [usize; 3] = core::array::from_fn(|a| at[a] + (base >> a & 1));
        let [nx, ny] = [block.dims[0] as usize, block.dims[1] as usize];
        let slot = 3 * (first + (base & 1) + nx * ((base >> 1 & 1) + ny * (base >> 2 & 1))) + axis;
        if self.local[slot] != u32::MAX {
            return self.local[slot];
        }
        let on_border =
            (0..3).any(|a| a != axis && (at[a] == 0 || at[a] + 1 == block.dims[a] as usize));
        let grid: [u32; 3] = core::array::from_fn(|a| block.first[a] + at[a] as u32);
        let key = self.edge_key(grid, axis);
        let shared = if on_border { self.border.get(&key).copied() } else { None };
        let index = shared.unwrap_or_else(|| {
            let (s0, s1) = (f64::from(s[base]), f64::from(s[base | 1 << axis]));
            let mut p = grid.map(f64::from);
            p[axis] += s0 / (s0 - s1);
            let p = self.origin + DVec3::from_array(p) * self.spacing_m;
            self.mesh.positions.push(p.to_array().map(|x| x as f32));
            let index = self.mesh.positions.len() as u32 - 1;
            if on_border {
                self.border.insert(key, index);
            }
            index
        });
        self.local[slot] = index;
        index
    }
}

/// Meshes a function of position, for tests and procedural scenes.
#[cfg(test)]
pub(crate) fn mesh_function(
    bounds: Bounds,
    resolution_m: f64,
    block_cells: u32,
    distance: impl Fn(DVec3) -> f64 + Sync,
) -> Mesh {
    let mut mesher = BlockMesher::with_block_cells(bounds, resolution_m, block_cells).unwrap();
    while let Some(block) = mesher.next_block() {
        let d: Vec<f32> =
            mte_slam_types::parallel::map(block.points(), |i| distance(block.point(i)) as f32);
        mesher.add_block(&block, &d).unwrap();
    }
    mesher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::{Topology, cube_bounds, topology};

    #[test]
    fn sphere_is_watertight_with_the_right_area_and_volume() {
        let r = 0.73;
        let mesh = mesh_function(cube_bounds(1.0), 0.05, 7, |p| p.length() - r);
        let Topology { euler, boundary_edges, bad_edges, components } = topology(&mesh);
        assert_eq!((euler, boundary_edges, bad_edges, components), (2, 0, 0, 1));
        let pi = core::f64::consts::PI;
        assert!((mesh.area() / (4.0 * pi * r * r) - 1.0).abs() < 0.01);
        // The signed volume is positive only for outward winding.
        let volume: f64 = (0..mesh.triangles.len())
            .map(|t| mesh.corners(t))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        assert!((volume / (4.0 / 3.0 * pi * r.powi(3)) - 1.0).abs() < 0.01, "{volume}");
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            let (p, n) = (crate::to_dvec3(*p), crate::to_dvec3(*n));
            assert!(n.dot(p.normalize()) > 0.95);
        }
    }

    #[test]
    fn torus_has_genus_one_and_block_size_does_not_matter() {
        let torus = |p: DVec3| ((p.x.hypot(p.y) - 0.6).powi(2) + p.z * p.z).sqrt() - 0.25;
        let mesh = mesh_function(cube_bounds(1.0), 0.04, 32, torus);
        let t = topology(&mesh);
        assert_eq!((t.euler, t.boundary_edges, t.bad_edges, t.components), (0, 0, 0, 1));
        let other = mesh_function(cube_bounds(1.0), 0.04, 5, torus);
        let sorted = |m: &Mesh| {
            let mut v: Vec<_> = m.positions.iter().map(|p| p.map(f32::to_bits)).collect();
            v.sort_unstable();
            v
        };
        assert_eq!(sorted(&mesh), sorted(&other));
        assert_eq!(mesh.triangles.len(), other.triangles.len());
    }

    #[test]
    fn plane_is_exact() {
        let n = DVec3::new(0.3, -0.5, 0.8).normalize();
        let mesh = mesh_function(cube_bounds(1.0), 0.1, 6, |p| p.dot(n) - 0.123);
        assert!(mesh.triangles.len() > 100);
        for (p, normal) in mesh.positions.iter().zip(&mesh.normals) {
            assert!((crate::to_dvec3(*p).dot(n) - 0.123).abs() < 1e-6);
            assert!(crate::to_dvec3(*normal).dot(n) > 0.9999);
        }
    }

    #[test]
    fn random_fields_have_no_cracks() {
        for seed in 0..4u64 {
            // Random signs on every grid point reach all 256 cases; positive at the border.
            let noise = |p: DVec3| {
                if p.abs().max_element() > 0.95 {
                    return 1.0;
                }
                let cell = ((p + 1.0) * 10.0).round();
                let mut h = (cell.x + 50.0 * cell.y + 2500.0 * cell.z) as u64 + (seed << 40);
                h = (h ^ h >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                h = (h ^ h >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
                ((h ^ h >> 31) % 2001) as f64 / 1000.0 - 1.0005
            };
            let mesh = mesh_function(cube_bounds(1.0), 0.1, 6, noise);
            let t = topology(&mesh);
            assert!(mesh.triangles.len() > 5000);
            assert_eq!((t.boundary_edges, t.bad_edges), (0, 0));
        }
    }

    #[test]
    fn unknown_points_leave_a_hole_and_order_is_enforced() {
        let mut mesher = BlockMesher::new(cube_bounds(1.0), 0.1).unwrap();
        let block = mesher.next_block().unwrap();
        let d: Vec<f32> = (0..block.points())
            .map(|i| block.point(i))
            .map(|p| if p.x > 0.0 { f32::NAN } else { p.z as f32 + 0.01 })
            .collect();
        let mut early = block.clone();
        early.sequence = 1;
        assert_eq!(
            mesher.add_block(&early, &d),
            Err(MeshError::BlockOrder { found: 1, expected: 0 })
        );
        assert!(mesher.add_block(&block, &d[1..]).is_err());
        mesher.add_block(&block, &d).unwrap();
        assert!(mesher.skip_block(&block).is_err());
        assert!(mesher.next_block().is_none());
        let mesh = mesher.finish();
        assert!(!mesh.triangles.is_empty());
        assert!(mesh.positions.iter().all(|p| p[0] <= 1e-6));
    }

    #[test]
    fn blocks_that_disagree_on_shared_points_leave_no_cracks() {
        // Rounding noise that differs from block to block around a plane through grid points.
        let mut mesher = BlockMesher::with_block_cells(cube_bounds(1.0), 0.125, 4).unwrap();
        while let Some(block) = mesher.next_block() {
            let d: Vec<f32> = (0..block.points())
                .map(|i| {
                    let p = block.point(i);
                    if p.abs().max_element() > 0.9 {
                        return 1.0;
                    }
                    let noise = (i as u64 + 977 * block.sequence).wrapping_mul(0x9e37_79b9) >> 7;
                    p.z.abs() as f32 - 0.5 + ((noise % 5) as f32 - 2.0) * 1e-6
                })
                .collect();
            mesher.add_block(&block, &d).unwrap();
        }
        let t = topology(&mesher.finish());
        assert_eq!((t.boundary_edges, t.bad_edges, t.components, t.euler), (0, 0, 1, 2));
    }

    #[test]
    fn bad_grids_are_refused() {
        let b = cube_bounds(1.0);
        assert!(BlockMesher::new(b, 0.0).is_err());
        assert!(BlockMesher::new(b, f64::NAN).is_err());
        assert!(BlockMesher::new(b, 1e-9).is_err());
        assert!(BlockMesher::new(Bounds { min: b.max, max: b.min }, 0.1).is_err());
        let nan = Bounds { min: DVec3::splat(f64::NAN), max: b.max };
        assert!(BlockMesher::new(nan, 0.1).is_err());
    }

    #[test]
    fn probes_never_miss_a_surface() {
        let sphere = |p: DVec3| p.length() - 0.4;
        let mut mesher = BlockMesher::with_block_cells(cube_bounds(1.0), 0.02, 16).unwrap();
        let (mut skipped, mut kept) = (0, 0);
        while let Some(block) = mesher.next_block() {
            let probe = block.probe(4);
            let values = |b: &Block| -> Vec<f32> {
                (0..b.points()).map(|i| sphere(b.point(i)) as f32).collect()
            };
            let d = values(&block);
            if probe.may_hold_surface(&values(&probe), 0.0) {
                kept += 1;
                mesher.add_block(&block, &d).unwrap();
            } else {
                skipped += 1;
                assert!(d.iter().all(|&x| x < 0.0) || d.iter().all(|&x| x >= 0.0));
                mesher.skip_block(&block).unwrap();
            }
        }
        assert!(skipped > kept, "{skipped} {kept}");
        assert_eq!(topology(&mesher.finish()).boundary_edges, 0);
    }
}
