//! A mesh against the true one, by the protocols of the field.
use crate::{
    metrics::Metrics,
    protocol::{Culling, Protocol},
};
use anyhow::{Context, Result, bail};
use mte_slam_mesh::{CullProtocol, DepthRenderer, Keep, Mesh, Visibility};
use mte_slam_metrics::{
    DepthViews, MeshDepthReport, SurfaceOptions, SurfaceReport, VIRTUAL_CAMERA, culling_views,
    depth_l1, depth_views, evaluate_surface,
};
use mte_slam_types::{camera::Camera, pose::Pose, sequence::Sequence};
use serde::Serialize;
use std::path::Path;

/// How far behind the sensor's depth ESLAM's culling looks \[m\].
const TRUNCATION_M: f64 = 0.06;
/// How far behind the rendered depth Co-SLAM's culling looks \[m\].
const TOLERANCE_M: f64 = 0.03;
/// Virtual views that help Co-SLAM's culling.
const CULLING_VIEWS: usize = 100;
/// Pairs of points further apart than this are no pairs to ICP \[m\].
const ICP_M: f64 = 0.1;

/// A true mesh.
pub struct MeshTruth {
    /// The mesh, in the world frame of the true poses.
    pub mesh: Mesh,
}

impl MeshTruth {
    /// Reads a PLY file.
    pub fn read(path: &Path) -> Result<MeshTruth> {
        let name = path.display();
        let bytes =
            std::fs::read(path).with_context(|| format!("{name}: the true mesh cannot be read"))?;
        let mesh = mte_slam_mesh::read_ply(&bytes)
            .with_context(|| format!("{name}: not a mesh in PLY format"))?;
        if mesh.triangles.is_empty() {
            bail!("{name}: the true mesh: found no faces, expected a triangle mesh");
        }
        Ok(MeshTruth { mesh })
    }

    /// The mesh of `flag`, or else `mesh.ply` in the recording's folder, or why there is none.
    /// A file that is there but unreadable is an error.
    pub fn find(flag: Option<&Path>, dataset: &Path) -> Result<Result<MeshTruth, String>> {
        if let Some(path) = flag {
            return Ok(Ok(MeshTruth::read(path)?));
        }
        let path = dataset.join("mesh.ply");
        if path.is_file() {
            return Ok(Ok(MeshTruth::read(&path)?));
        }
        Ok(
            Err("there is no true mesh (mesh.ply in the recording; --mesh names another)"
                .to_owned()),
        )
    }
}

/// Which figures of a mesh are wanted.
#[derive(Clone, Debug)]
pub struct MeshProtocols {
    /// Accuracy, completion and ratio after ESLAM's culling.
    pub eslam: bool,
    /// The same after Co-SLAM's.
    pub coslam: bool,
    /// The same after NICE-SLAM's.
    pub frustum: bool,
    /// Align ours to the true mesh first.
    pub icp: bool,
    /// Virtual views of depth L1; 0 for none.
    pub depth_views: usize,
    /// Seed of samples and views.
    pub seed: u32,
}

impl Default for MeshProtocols {
    fn default() -> Self {
        MeshProtocols {
            eslam: true,
            coslam: true,
            frustum: false,
            icp: false,
            depth_views: 1000,
            seed: 0,
        }
    }
}

/// The views that the figures are about, for other programs to repeat them. Poses are
/// `world_from_camera`, row by row.
#[derive(Debug, Serialize)]
pub struct ProtocolViews {
    /// The recording's camera, of real and virtual culling views.
    pub camera: Camera,
    /// True poses of the frames.
    pub real: Vec<[f64; 16]>,
    /// Co-SLAM's virtual views.
    pub culling: Vec<[f64; 16]>,
    /// Camera of the views of depth L1.
    pub depth_camera: Camera,
    /// Views of depth L1.
    pub depth: Vec<[f64; 16]>,
    /// Samples of the true surface that no frame has in its frustum \[m\].
    pub unseen: Vec<[f32; 3]>,
    /// Seed of all this.
    pub seed: u32,
}

/// Puts the figures of `ours` against the true mesh, or why there are none, into `metrics`.
pub fn score(
    ours: Mesh,
    truth: MeshTruth,
    sequence: &mut dyn Sequence,
    protocols: &MeshProtocols,
    metrics: &mut Metrics,
) -> Option<ProtocolViews> {
    match compare(ours, truth, sequence, protocols, metrics) {
        Ok(views) => Some(views),
        Err(reason) => {
            metrics.absent.insert("mesh", format!("{reason:#}"));
            None
        }
    }
}

fn compare(
    mut ours: Mesh,
    truth: MeshTruth,
    sequence: &mut dyn Sequence,
    protocols: &MeshProtocols,
    metrics: &mut Metrics,
) -> Result<ProtocolViews> {
    let mut truth = truth.mesh;
    for m in [&mut ours, &mut truth] {
        // Only the surface counts; a fine mesh is large enough without the rest.
        (m.normals, m.colors, m.classes) = Default::default();
        m.check()?;
    }
    let camera = sequence.info().camera;
    let frames = sequence.info().frames;
    let poses: Vec<Pose> = (0..frames).filter_map(|i| sequence.truth(i)).collect();
    if poses.is_empty() {
        bail!("no frame has a true pose, so what was observed is not known");
    }
    let culled = |m: &Mesh, seen: &Visibility| {
        let mut part = m.clone();
        mte_slam_mesh::cull(&mut part, seen, Keep::AnySeen);
        part
    };
    let n = poses.len();
    if protocols.eslam {
        let protocol = CullProtocol::SensorDepth { truncation_m: TRUNCATION_M };
        let [a, b] = sensor_visibility([&ours, &truth], sequence, protocol)?;
        let mut pair = [culled(&ours, &a), culled(&truth, &b)];
        let how = format!("{} in {n} views", protocol.name());
        metrics.mesh = Some(surface(&mut pair, protocols, Culling::Eslam, &how)?);
    }
    if protocols.frustum {
        let protocol = CullProtocol::Frustum;
        let seen = |m: &Mesh| {
            let in_view = mte_slam_mesh::in_any_frustum(&m.positions, &camera, &poses);
            Visibility { unhidden: in_view.clone(), in_view }
        };
        let mut pair = [culled(&ours, &seen(&ours)), culled(&truth, &seen(&truth))];
        let how = format!("{} in {n} views", protocol.name());
        metrics.mesh_frustum = Some(surface(&mut pair, protocols, Culling::Frustum, &how)?);
    }
    let mut views = ProtocolViews {
        camera,
        real: poses.iter().map(Pose::to_row_major).collect(),
        culling: Vec::new(),
        depth_camera: VIRTUAL_CAMERA,
        depth: Vec::new(),
        unseen: Vec::new(),
        seed: protocols.seed,
    };
    if !protocols.coslam && protocols.depth_views == 0 {
        return Ok(views);
    }
    let virtual_poses = {
        let renderer = DepthRenderer::new(&truth);
        culling_views(&renderer, &camera, &poses, CULLING_VIEWS, protocols.seed)
    };
    views.culling = virtual_poses.iter().map(Pose::to_row_major).collect();
    let protocol = CullProtocol::RenderedDepth { tolerance_m: TOLERANCE_M };
    let seen = |m: &Mesh| {
        let mut seen = Visibility::new(m);
        let renderer = DepthRenderer::new(m);
        for (some, real) in [(&poses, true), (&virtual_poses, false)] {
            seen.add_rendered(m, &renderer, &camera, some, real, TOLERANCE_M);
        }
        seen
    };
    let seen_of_ours = seen(&ours);
    mte_slam_mesh::cull(&mut ours, &seen_of_ours, Keep::AnySeen);
    drop(seen_of_ours);
    let mut pair = [ours, culled(&truth, &seen(&truth))];
    let how = format!("{} in {n} real and {} virtual views", protocol.name(), virtual_poses.len());
    if protocols.coslam {
        metrics.mesh_coslam = Some(surface(&mut pair, protocols, Culling::Coslam, &how)?);
    } else if protocols.icp {
        align(&mut pair, protocols.seed)?;
    }
    if protocols.depth_views > 0 {
        let [ours, culled_truth] = &pair;
        let drawn = depth_views(
            culled_truth,
            &truth,
            &camera,
            &poses,
            protocols.depth_views,
            protocols.seed,
        )?;
        match depth(ours, culled_truth, &drawn, &how, protocols.icp) {
            Ok(report) => metrics.mesh_depth = Some(report),
            Err(reason) => {
                metrics.absent.insert("mesh_depth", format!("{reason:#}"));
            }
        }
        views.depth = drawn.poses.iter().map(Pose::to_row_major).collect();
        views.unseen = drawn.unseen;
    }
    Ok(views)
}

/// What the frames' own depth shows of two meshes.
fn sensor_visibility(
    meshes: [&Mesh; 2],
    sequence: &mut dyn Sequence,
    protocol: CullProtocol,
) -> Result<[Visibility; 2]> {
    let info = sequence.info().clone();
    let mut seen = meshes.map(Visibility::new);
    for index in 0..info.frames {
        let Some(world_from_camera) = sequence.truth(index) else { continue };
        let frame = sequence.frame(index)?;
        let view = mte_slam_mesh::CullingView {
            camera: &info.camera,
            world_from_camera,
            depth: &frame.depth,
            depth_unit_m: info.depth_unit_m,
        };
        for (seen, mesh) in seen.iter_mut().zip(meshes) {
            seen.add_view(mesh, &view, protocol);
        }
    }
    Ok(seen)
}

/// Aligns the first mesh of a pair to the second.
fn align([ours, truth]: &mut [Mesh; 2], seed: u32) -> Result<()> {
    let aligned = mte_slam_metrics::icp(ours, truth, ICP_M, seed)?;
    ours.transform(&aligned);
    Ok(())
}

fn alignment(icp: bool) -> &'static str {
    if icp { "after ICP (point to point, 0.1 m)" } else { "no alignment" }
}

fn surface(
    pair: &mut [Mesh; 2],
    protocols: &MeshProtocols,
    culling: Culling,
    how: &str,
) -> Result<SurfaceReport> {
    let MeshProtocols { seed, icp, .. } = *protocols;
    if protocols.icp {
        align(pair, seed)?;
    }
    let options = SurfaceOptions { seed, ..SurfaceOptions::default() };
    let mut report = evaluate_surface(&pair[0], &pair[1], &options)?;
    report.protocol_id = Protocol::Surface { culling, icp }.id();
    report.protocol = format!("{}; {how}; {}", report.protocol, alignment(protocols.icp));
    Ok(report)
}

fn depth(
    ours: &Mesh,
    truth: &Mesh,
    views: &DepthViews,
    how: &str,
    icp: bool,
) -> Result<MeshDepthReport> {
    let mut report = depth_l1(ours, truth, views)?;
    report.protocol_id = Protocol::MeshDepth { views: report.wanted_views, icp }.id();
    report.protocol = format!("{}; {how}; {}", report.protocol, alignment(icp));
    Ok(report)
}
