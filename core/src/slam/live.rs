//! A mesh that follows the map while it grows: only the parts that new frames have touched are
//! extracted again, in chunks that a viewer can replace one by one.
use super::{
    PoseEstimate, Slam, SlamError,
    keyframes::{Observation, observation_step},
};
use crate::{
    camera::Camera,
    classes::UNLABELLED,
    engine::Engine,
    frame::Bounds,
    map::{Map, Scratch, passes},
    mesh::{self, Block, BlockMesher, CullProtocol, Keep, Mesh, Visibility},
};
use alloc::{
    collections::{BTreeMap, BTreeSet},
    vec::Vec,
};
use glam::DVec3;

/// Cells along a chunk's edge.
const CHUNK_CELLS: u32 = 16;
/// As for whole meshes: beyond half a cell, a probe may be this far off a surface \[m\].
const PROBE_SLACK_M: f64 = 0.03;

/// Which chunks of the growing mesh are out of date. Chunks lie on a grid through the world's
/// origin, so that a map that grows keeps them.
#[derive(Clone, Debug)]
pub struct LiveMesh {
    resolution_m: f64,
    /// Observations already looked at.
    seen: usize,
    dirty: BTreeSet<[i32; 3]>,
    /// Triangles of each chunk that is not empty.
    triangles: BTreeMap<[i32; 3], usize>,
}

/// A chunk that changed; an empty mesh takes the place of one that has vanished.
#[derive(Clone, Debug)]
pub struct MeshChunk {
    /// Position on the grid of chunks.
    pub key: [i32; 3],
    /// Its surface, with normals, colours and (with semantics) classes.
    pub mesh: Mesh,
}

impl LiveMesh {
    /// An empty mesh with cells of `resolution_m`, at least 1 mm.
    pub fn new(resolution_m: f64) -> LiveMesh {
        let resolution_m = if resolution_m >= 1e-3 { resolution_m } else { 1e-3 };
        LiveMesh { resolution_m, seen: 0, dirty: BTreeSet::new(), triangles: BTreeMap::new() }
    }

    /// Chunks that wait to be extracted.
    pub fn pending(&self) -> usize {
        self.dirty.len()
    }

    /// Triangles of all chunks as they were last extracted.
    pub fn triangles(&self) -> usize {
        self.triangles.values().sum()
    }

    /// Marks all that was ever observed, for example after the last optimisation.
    pub fn touch_all(&mut self) {
        self.seen = 0;
    }

    fn chunk_m(&self) -> f64 {
        self.resolution_m * f64::from(CHUNK_CELLS)
    }

    /// Marks the chunks around what one mapped frame measured.
    fn touch(&mut self, o: &Observation, f: &PoseEstimate, camera: &Camera, unit: f64, reach: f64) {
        let chunk = self.chunk_m();
        for (i, d) in o.depth.iter().enumerate().filter(|(_, d)| **d > 0) {
            let (u, v) = (i % camera.width as usize, i / camera.width as usize);
            let p = camera.back_project(u as f64, v as f64, f64::from(*d) * unit);
            let p = f.world_from_camera.transform_point(p);
            let (low, high) = ((p - reach) / chunk, (p + reach) / chunk);
            let cell = |p: DVec3| p.to_array().map(|x| num_traits::Float::floor(x) as i32);
            let (low, high) = (cell(low), cell(high));
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    self.dirty.extend((low[0]..=high[0]).map(|x| [x, y, z]));
                }
            }
        }
    }
}

impl Slam {
    /// Extracts chunks that mapped frames have touched since they were last extracted, at most
    /// `limit` at a time (the rest waits for the next call), and returns those that changed.
    ///
    /// # Errors
    /// [`SlamError::NoMap`], engine failures.
    pub async fn update_live_mesh(
        &mut self,
        live: &mut LiveMesh,
        limit: usize,
    ) -> Result<Vec<MeshChunk>, SlamError> {
        let truncation_m = self.config.field.truncation_m;
        let unit = self.info.depth_unit_m;
        let camera = self.info.camera.downscaled(observation_step(self.info.camera.width));
        for o in self.observations.iter().skip(live.seen) {
            if let Some(f) = self.frames.get(o.frame) {
                live.touch(o, f, &camera, unit, truncation_m);
            }
        }
        live.seen = self.observations.len();

        let (engine, map, scratch) = self.mapped()?;
        let held = map.shape.bounds;
        let mut taken = Vec::new();
        while taken.len() < limit
            && let Some(key) = live.dirty.pop_first()
        {
            let min = DVec3::from_array(key.map(f64::from)) * live.chunk_m();
            let bounds = Bounds { min, max: min + live.chunk_m() };
            if bounds.min.cmpge(held.max).any() || bounds.max.cmple(held.min).any() {
                continue;
            }
            let mut mesher = BlockMesher::with_block_cells(bounds, live.resolution_m, CHUNK_CELLS)?;
            if let Some(block) = mesher.next_block() {
                taken.push((key, mesher, block));
            }
        }

        // One read-back for all chunks' probes, one for all distances, one for all surfaces: on
        // the web each costs some milliseconds of waiting whatever its size.
        let probes: Vec<Block> = taken.iter().map(|(_, _, block)| block.probe(4)).collect();
        let distances = distances(engine, map, scratch, &probes, held, truncation_m).await?;
        let mut holds = probes.iter().zip(&distances);
        let (mut full, mut chunks) = (Vec::new(), Vec::new());
        for (key, mesher, block) in taken {
            if holds.next().is_some_and(|(probe, d)| probe.may_hold_surface(d, PROBE_SLACK_M)) {
                full.push((key, mesher, block));
            } else {
                chunks.push(MeshChunk { key, mesh: Mesh::default() });
            }
        }
        let blocks: Vec<Block> = full.iter().map(|(_, _, block)| block.clone()).collect();
        let distances = self::distances(engine, map, scratch, &blocks, held, truncation_m).await?;
        for ((key, mut mesher, block), d) in full.into_iter().zip(&distances) {
            mesher.add_block(&block, d)?;
            chunks.push(MeshChunk { key, mesh: mesher.finish() });
        }

        let protocol = CullProtocol::SensorDepth { truncation_m };
        let mut points = Vec::new();
        for chunk in chunks.iter_mut().filter(|c| !c.mesh.triangles.is_empty()) {
            let mut seen = Visibility::new(&chunk.mesh);
            for o in &self.observations {
                let Some(f) = self.frames.get(o.frame) else { continue };
                let world_from_camera = f.world_from_camera;
                let (camera, depth, depth_unit_m) = (&camera, &o.depth[..], unit);
                let view = mesh::CullingView { camera, world_from_camera, depth, depth_unit_m };
                seen.add_view(&chunk.mesh, &view, protocol);
            }
            mesh::cull(&mut chunk.mesh, &seen, Keep::AllSeen);
            points.extend(chunk.mesh.positions.iter().map(|p| [p[0], p[1], p[2], 0.0]));
        }
        let by_anchors = self.classes_by_anchors();
        let (engine, map, scratch) = self.mapped()?;
        let classes = map.classes > 0;
        let values = passes::query_surface(engine, map, scratch, &points, by_anchors).await?;
        let mut values = values.chunks_exact(8);
        chunks.retain_mut(|chunk| {
            for v in values.by_ref().take(chunk.mesh.positions.len()) {
                let byte = |x: f32| (x * 255.0 + 0.5).clamp(0.0, 255.0) as u8;
                chunk.mesh.colors.push([byte(v[4]), byte(v[5]), byte(v[6])]);
                if classes {
                    chunk.mesh.classes.push(v[1].to_bits().min(u32::from(UNLABELLED)) as u8);
                }
            }
            let (before, now) = (live.triangles.remove(&chunk.key), chunk.mesh.triangles.len());
            if now > 0 {
                live.triangles.insert(chunk.key, now);
            }
            now > 0 || before.is_some()
        });
        Ok(chunks)
    }
}

/// Signed distances \[m\] at the points of several blocks; unknown outside the map.
async fn distances(
    engine: &mut Engine,
    map: &Map,
    scratch: &Scratch,
    blocks: &[Block],
    held: Bounds,
    truncation_m: f64,
) -> Result<Vec<Vec<f32>>, SlamError> {
    let at = |b: &Block| (0..b.points()).map(|i| b.point(i)).collect::<Vec<_>>();
    let points: Vec<DVec3> = blocks.iter().flat_map(at).collect();
    let rows: Vec<[f32; 4]> =
        points.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32, 0.0]).collect();
    let found = passes::query_distances(engine, map, scratch, &rows).await?;
    let inside = |p: &DVec3| p.cmpge(held.min).all() && p.cmple(held.max).all();
    let mut all = points
        .iter()
        .zip(found)
        .map(|(p, d)| if inside(p) { d * truncation_m as f32 } else { f32::NAN });
    Ok(blocks.iter().map(|b| all.by_ref().take(b.points()).collect()).collect())
}
