//! What comes out of a map: rendered views and meshes.
use super::{Slam, SlamError, keyframes::observation_step, system::VIEW_SLOT};
use crate::{
    camera::Camera,
    classes::UNLABELLED,
    commands::Commands,
    engine::Engine,
    frame::Frame,
    kernels::shared::{FLAG_ANCHORS, FLAG_DENSE, FLAG_GUIDED},
    layout::RAY_OUT_FLOATS,
    map::{Batch, Map, Scratch, SemanticSupervision, passes},
    mesh::{self, BlockMesher, ComponentSize, CullProtocol, Keep, Mesh, Visibility},
    pose::Pose,
};
use alloc::vec::Vec;

/// Rays with less opacity show nothing.
const MIN_OPACITY: f32 = 0.5;
/// A block is skipped unless a probe finds a surface within this \[m\], beyond half a cell: the
/// learned distance is projective, steeper than 1 at grazing views.
const PROBE_SLACK_M: f64 = 0.03;

/// A rendered view.
#[derive(Clone, Debug)]
pub struct View {
    /// Its camera.
    pub camera: Camera,
    /// sRGB.
    pub color: Vec<[u8; 3]>,
    /// Depth along z \[m\], 0 where nothing is.
    pub depth_m: Vec<f32>,
    /// Compact class, [`UNLABELLED`] where nothing is or without semantics.
    pub class: Vec<u8>,
}

impl Slam {
    /// Renders the map, without any help from a sensor's depth.
    ///
    /// # Errors
    /// [`SlamError::NoMap`], engine failures.
    pub async fn render(&mut self, pose: &Pose, camera: &Camera) -> Result<View, SlamError> {
        self.render_view(pose, camera, None).await
    }

    /// Renders the map where a sensor's depth says that the surface is, as some peers evaluate;
    /// pixels without depth as in [`Slam::render`].
    ///
    /// # Errors
    /// As [`Slam::render`]; [`SlamError::Frame`] for a frame of another size.
    pub async fn render_at_depth(&mut self, pose: &Pose, frame: &Frame) -> Result<View, SlamError> {
        self.check(frame)?;
        let camera = self.info.camera;
        self.render_view(pose, &camera, Some(frame)).await
    }

    async fn render_view(
        &mut self,
        pose: &Pose,
        camera: &Camera,
        guide: Option<&Frame>,
    ) -> Result<View, SlamError> {
        let s = self.config.sampling.clone();
        let loss = self.config.loss.clone();
        let inference = if self.classes_by_anchors() { FLAG_ANCHORS } else { 0 };
        let guided = if guide.is_some() { FLAG_GUIDED } else { 0 };
        let (engine, map, scratch) = self.mapped()?;
        let pixels = camera.pixels();
        let mut view = View {
            camera: *camera,
            color: Vec::with_capacity(pixels),
            depth_m: Vec::with_capacity(pixels),
            class: Vec::with_capacity(pixels),
        };
        let mut first = 0;
        while first < pixels as u32 {
            let rays = scratch.max_rays.min(pixels as u32 - first);
            let batch = Batch {
                frames: 1,
                rays_per_frame: rays,
                stratified: s.render_stratified,
                surface: s.render_surface,
                flags: FLAG_DENSE | guided | inference,
                loss: &loss,
                iteration: 0,
                first,
                camera: Some(camera),
                rare_share: 0.0,
                supervision: SemanticSupervision::default(),
            };
            let mut r = Commands::default();
            if let (Some(frame), 0) = (guide, first) {
                map.frames.upload_frame(&mut r, VIEW_SLOT, frame);
            }
            map.frames.upload_pose(&mut r, VIEW_SLOT, pose);
            scratch.upload_window(&mut r, &[(VIEW_SLOT, true)]);
            passes::record_forward(&mut r, map, scratch, &batch);
            engine.submit(&r)?;
            let out = scratch.read_ray_out(engine, rays).await?;
            for ray in out.chunks_exact(RAY_OUT_FLOATS) {
                let solid = ray[4] > MIN_OPACITY;
                let byte = |x: f32| (x * 255.0 + 0.5).clamp(0.0, 255.0) as u8;
                view.color.push([byte(ray[0]), byte(ray[1]), byte(ray[2])]);
                view.depth_m.push(if solid { ray[3] / ray[4] } else { 0.0 });
                let class = ray[5].to_bits().min(u32::from(UNLABELLED)) as u8;
                view.class.push(if solid { class } else { UNLABELLED });
            }
            first += rays;
        }
        Ok(view)
    }

    /// Marching cubes of the signed distance, culled to what mapped frames observed, with colours
    /// and classes from the map. `progress` is called with shares of the work done, 0 to 1.
    ///
    /// # Errors
    /// [`SlamError::NoMap`], a resolution that is not usable, engine failures.
    pub async fn extract_mesh(
        &mut self,
        resolution_m: f64,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Mesh, SlamError> {
        let truncation = self.config.field.truncation_m;
        let min_triangles = self.config.mesh.min_component_triangles as usize;
        let (engine, map, scratch) = self.mapped()?;
        let mut mesher = BlockMesher::new(map.shape.bounds, resolution_m)?;
        let total = mesher.total_blocks().max(1) as f64;
        while let Some(block) = mesher.next_block() {
            let coarse = block.probe(4);
            let probe = grid_distances(engine, map, scratch, &coarse, truncation).await?;
            if coarse.may_hold_surface(&probe, PROBE_SLACK_M) {
                let distances = grid_distances(engine, map, scratch, &block, truncation).await?;
                mesher.add_block(&block, &distances)?;
            } else {
                mesher.skip_block(&block)?;
            }
            progress(0.8 * mesher.done_blocks() as f64 / total);
        }
        let mut mesh = mesher.finish();

        let step = observation_step(self.info.camera.width);
        let camera = self.info.camera.downscaled(step);
        let protocol = CullProtocol::SensorDepth { truncation_m: truncation };
        let mut seen = Visibility::new(&mesh);
        for (i, o) in self.observations.iter().enumerate() {
            let Some(f) = self.frames.get(o.frame) else { continue };
            let view = mesh::CullingView {
                camera: &camera,
                world_from_camera: f.world_from_camera,
                depth: &o.depth,
                depth_unit_m: self.info.depth_unit_m,
            };
            seen.add_view(&mesh, &view, protocol);
            progress(0.8 + 0.15 * (i + 1) as f64 / self.observations.len() as f64);
        }
        mesh::cull(&mut mesh, &seen, Keep::AllSeen);
        mesh.remove_small_components(ComponentSize::Triangles(min_triangles));
        mesh.compute_normals();

        let points: Vec<[f32; 4]> =
            mesh.positions.iter().map(|p| [p[0], p[1], p[2], 0.0]).collect();
        let by_anchors = self.classes_by_anchors();
        let (engine, map, scratch) = self.mapped()?;
        let classes = map.classes > 0;
        let values = passes::query_surface(engine, map, scratch, &points, by_anchors).await?;
        for v in values.chunks_exact(8) {
            mesh.colors.push([v[4], v[5], v[6]].map(|x| (x * 255.0 + 0.5).clamp(0.0, 255.0) as u8));
            if classes {
                mesh.classes.push(v[1].to_bits().min(u32::from(UNLABELLED)) as u8);
            }
        }
        progress(1.0);
        Ok(mesh)
    }
}

/// Signed distances \[m\] at a block's points.
async fn grid_distances(
    engine: &mut Engine,
    map: &Map,
    scratch: &Scratch,
    block: &mesh::Block,
    truncation_m: f64,
) -> Result<Vec<f32>, SlamError> {
    let points: Vec<[f32; 4]> = (0..block.points())
        .map(|i| {
            let p = block.point(i);
            [p.x as f32, p.y as f32, p.z as f32, 0.0]
        })
        .collect();
    let mut d = passes::query_distances(engine, map, scratch, &points).await?;
    for v in &mut d {
        *v *= truncation_m as f32;
    }
    Ok(d)
}
