//! Which part of a mesh was observed. Three protocols of the field; both meshes of a comparison
//! must be culled alike.
use super::{DepthRenderer, Mesh, to_dvec3};
use alloc::{vec, vec::Vec};
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};
use glam::DVec3;
use mte_slam_types::parallel;
use mte_slam_types::{camera::Camera, pose::Pose};

/// One image that observed the scene.
#[derive(Clone, Copy, Debug)]
pub struct CullingView<'a> {
    /// The image's camera.
    pub camera: &'a Camera,
    /// The camera's pose in the frame of the mesh.
    pub world_from_camera: Pose,
    /// Sensor depth along z, row-major, 0 invalid; empty for a virtual view.
    pub depth: &'a [u16],
    /// Metres per unit of `depth`.
    pub depth_unit_m: f64,
}

impl CullingView<'_> {
    /// Returns depth along z \[m\] of a world point and the index of the pixel that it falls on, if any.
    fn pixel(&self, camera_from_world: &Pose, world: [f32; 3]) -> Option<(f64, usize)> {
        let p = camera_from_world.transform_point(to_dvec3(world));
        let uv = self.camera.project(p)?;
        let (u, v) = (uv.x + 0.5, uv.y + 0.5);
        let (w, h) = (f64::from(self.camera.width), f64::from(self.camera.height));
        // Written so that NaN fails.
        let inside = u >= 0.0 && v >= 0.0 && u < w && v < h;
        inside.then(|| (p.z, v as usize * self.camera.width as usize + u as usize))
    }
}

/// What counts as observed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum CullProtocol {
    /// ESLAM's: a vertex falls on a pixel with sensor depth, no deeper than that depth plus the
    /// truncation \[m\] (0.06). Pixels without sensor depth observe nothing.
    SensorDepth {
        /// How far behind the measurement a vertex may lie \[m\].
        truncation_m: f64,
    },
    /// Co-SLAM's: a vertex is in a real view's frustum, and a vertex is visible in a real or virtual
    /// view, that is, less deep than a rendering of the mesh itself plus the tolerance \[m\] (0.03).
    /// Where that shows no surface nothing is visible.
    RenderedDepth {
        /// How far behind the rendered surface a vertex may lie \[m\].
        tolerance_m: f64,
    },
    /// NICE-SLAM's and iMAP's: a vertex is in a real view's frustum, hidden or not.
    Frustum,
}

impl CullProtocol {
    /// Returns the name that figures culled in this way carry.
    pub fn name(&self) -> &'static str {
        match self {
            CullProtocol::SensorDepth { .. } => "culled to frustum and sensor depth (ESLAM)",
            CullProtocol::RenderedDepth { .. } => "culled to frustum and visibility (Co-SLAM)",
            CullProtocol::Frustum => "culled to the frustum alone (NICE-SLAM)",
        }
    }
}

/// Depth along z \[m\] of a camera-frame point and the index of the pixel that it falls on, if it
/// lies between the centres of the image's outermost pixels, as the peers want it.
fn between_centres(camera: &Camera, p: DVec3) -> Option<(f64, usize)> {
    let uv = camera.project(p)?;
    let (w, h) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
    // Written so that NaN fails.
    let inside = uv.x >= 0.0 && uv.y >= 0.0 && uv.x <= w && uv.y <= h;
    inside.then(|| (p.z, (uv.y + 0.5) as usize * camera.width as usize + (uv.x + 0.5) as usize))
}

/// Returns whether each point is in the frustum of some pose.
pub fn in_any_frustum(points: &[[f32; 3]], camera: &Camera, poses: &[Pose]) -> Vec<bool> {
    let cameras: Vec<Pose> = poses.iter().map(Pose::inverse).collect();
    parallel::map(points.len(), |i| {
        let p = to_dvec3(points[i]);
        cameras.iter().any(|c| between_centres(camera, c.transform_point(p)).is_some())
    })
}

/// How many corners of a triangle must be observed for it to stay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// At least one: drops triangles with all corners unseen (both protocols' usual rule).
    AnySeen,
    /// All three: drops triangles with any corner unseen.
    AllSeen,
}

/// What the views so far have seen of a mesh's vertices. Views can be added one at a time, so a
/// sequence need not be in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Visibility {
    /// A vertex is in a real view's frustum (`RenderedDepth`, `Frustum`), or observed
    /// (`SensorDepth`).
    pub in_view: Vec<bool>,
    /// A vertex is visible in some view (`RenderedDepth`), in a frustum, or observed.
    pub unhidden: Vec<bool>,
}

impl Visibility {
    /// Nothing seen yet of a mesh's vertices.
    pub fn new(mesh: &Mesh) -> Visibility {
        let unseen = vec![false; mesh.positions.len()];
        Visibility { in_view: unseen.clone(), unhidden: unseen }
    }

    /// Adds what one view sees. A view without depth is virtual: it observes nothing under
    /// `SensorDepth`, and only helps visibility under `RenderedDepth`. Depth of a wrong size counts
    /// as missing where it has no pixel.
    pub fn add_view(&mut self, mesh: &Mesh, view: &CullingView<'_>, protocol: CullProtocol) {
        let camera_from_world = view.world_from_camera.inverse();
        let place = |i: usize| view.pixel(&camera_from_world, mesh.positions[i]);
        let n = mesh.positions.len();
        // Two bits per vertex: in view, unhidden.
        let seen: Vec<(bool, bool)> = match protocol {
            CullProtocol::SensorDepth { truncation_m } => parallel::map(n, |i| {
                if self.in_view[i] {
                    return (true, true);
                }
                let observed = place(i).is_some_and(|(z, pixel)| {
                    let depth = view.depth.get(pixel).map_or(0.0, |&d| f64::from(d));
                    depth > 0.0 && z < depth * view.depth_unit_m + truncation_m
                });
                (observed, observed)
            }),
            CullProtocol::RenderedDepth { tolerance_m } => {
                let pose = [view.world_from_camera];
                let real = !view.depth.is_empty();
                let renderer = DepthRenderer::new(mesh);
                return self.add_rendered(mesh, &renderer, view.camera, &pose, real, tolerance_m);
            }
            CullProtocol::Frustum => parallel::map(n, |i| {
                let p = camera_from_world.transform_point(to_dvec3(mesh.positions[i]));
                let inside = !view.depth.is_empty() && between_centres(view.camera, p).is_some();
                (inside, inside)
            }),
        };
        for (i, (in_view, unhidden)) in seen.into_iter().enumerate() {
            self.in_view[i] |= in_view;
            self.unhidden[i] |= unhidden;
        }
    }

    /// Adds what many views of one camera see under [`CullProtocol::RenderedDepth`], in parallel.
    /// `renderer` is that of `mesh`; `real` views count for `in_view`, virtual ones do not.
    pub fn add_rendered(
        &mut self,
        mesh: &Mesh,
        renderer: &DepthRenderer<'_>,
        camera: &Camera,
        poses: &[Pose],
        real: bool,
        tolerance_m: f64,
    ) {
        // A flag is only ever set, so the order of the views does not matter.
        let shared = |flags: &[bool]| -> Vec<AtomicBool> {
            flags.iter().map(|&f| AtomicBool::new(f)).collect()
        };
        let (in_view, unhidden) = (shared(&self.in_view), shared(&self.unhidden));
        parallel::map(poses.len(), |k| {
            let camera_from_world = poses[k].inverse();
            let mut depth_m = Vec::new();
            for (i, p) in mesh.positions.iter().enumerate() {
                let known = unhidden[i].load(Relaxed);
                if known && (!real || in_view[i].load(Relaxed)) {
                    continue;
                }
                let p = camera_from_world.transform_point(to_dvec3(*p));
                let Some((z, pixel)) = between_centres(camera, p) else { continue };
                if real {
                    in_view[i].store(true, Relaxed);
                }
                if known {
                    continue;
                }
                // Late in a sequence most views show nothing new, and need no picture.
                if depth_m.is_empty() {
                    depth_m = renderer.depth_m(camera, &poses[k], f64::INFINITY);
                }
                let depth = f64::from(depth_m[pixel]);
                if depth > 0.0 && z < depth + tolerance_m {
                    unhidden[i].store(true, Relaxed);
                }
            }
        });
        self.in_view = in_view.into_iter().map(AtomicBool::into_inner).collect();
        self.unhidden = unhidden.into_iter().map(AtomicBool::into_inner).collect();
    }
}

/// Keeps the triangles of which enough corners are in view and enough are not hidden; drops unused
/// vertices.
pub fn cull(mesh: &mut Mesh, visibility: &Visibility, keep: Keep) {
    let triangles = core::mem::take(&mut mesh.triangles);
    let enough = |t: &[u32; 3], seen: &[bool]| match keep {
        Keep::AnySeen => t.iter().any(|&i| seen[i as usize]),
        Keep::AllSeen => t.iter().all(|&i| seen[i as usize]),
    };
    let stays = |t: &[u32; 3]| enough(t, &visibility.in_view) && enough(t, &visibility.unhidden);
    mesh.triangles = triangles.into_iter().filter(stays).collect();
    mesh.drop_unused_vertices();
}

/// Returns the part of a mesh that some views observed.
pub fn observed_part<'a>(
    mesh: &Mesh,
    views: impl IntoIterator<Item = CullingView<'a>>,
    protocol: CullProtocol,
    keep: Keep,
) -> Mesh {
    let mut visibility = Visibility::new(mesh);
    for view in views {
        visibility.add_view(mesh, &view, protocol);
    }
    let mut part = mesh.clone();
    cull(&mut part, &visibility, keep);
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;
    use core::f64::consts::PI;

    const CAMERA: Camera = Camera { width: 40, height: 40, fx: 40.0, fy: 40.0, cx: 19.5, cy: 19.5 };

    /// Two parallel 4 m squares, 1 and 2 m before the camera, centred.
    fn two_walls() -> Mesh {
        let mut mesh = square(40, 4.0, 1.0);
        let far = square(40, 4.0, 2.0);
        let offset = mesh.positions.len() as u32;
        mesh.positions.extend(far.positions);
        mesh.triangles.extend(far.triangles.iter().map(|t| t.map(|i| i + offset)));
        mesh.transform(&Pose { translation: DVec3::new(-2.0, -2.0, 0.0), ..Pose::IDENTITY });
        mesh
    }

    fn view(depth: &[u16]) -> CullingView<'_> {
        CullingView {
            camera: &CAMERA,
            world_from_camera: Pose::IDENTITY,
            depth,
            depth_unit_m: 1e-3,
        }
    }

    #[test]
    fn sensor_depth_keeps_what_was_measured() {
        let mesh = two_walls();
        let protocol = CullProtocol::SensorDepth { truncation_m: 0.06 };
        let mut depth = vec![1000u16; 1600];
        depth[..800].fill(0); // no measurement in the upper half
        let part = observed_part(&mesh, [view(&depth)], protocol, Keep::AllSeen);
        assert!(!part.triangles.is_empty());
        for p in &part.positions {
            assert!(p[2] == 1.0 && p[0].abs() <= 0.51 && p[1] >= -0.01 && p[1] <= 0.51, "{p:?}");
        }
        let more = observed_part(&mesh, [view(&depth)], protocol, Keep::AnySeen);
        assert!(more.triangles.len() > part.triangles.len());
        depth.fill(2500);
        let both = observed_part(&mesh, [view(&depth)], protocol, Keep::AllSeen);
        assert!(both.positions.iter().any(|p| p[2] == 2.0));
        // Truncated depth and a virtual view: no panic, nothing seen.
        assert!(observed_part(&mesh, [view(&[])], protocol, Keep::AnySeen).positions.is_empty());
    }

    #[test]
    fn rendered_depth_drops_what_is_hidden() {
        let mesh = two_walls();
        let protocol = CullProtocol::RenderedDepth { tolerance_m: 0.03 };
        let depth = vec![1000u16; 1600];
        let part = observed_part(&mesh, [view(&depth)], protocol, Keep::AllSeen);
        assert!(part.positions.len() > 50 && part.positions.iter().all(|p| p[2] == 1.0));
        // A virtual view from behind reveals the far wall where the real view's frustum has it.
        let mut behind = view(&[]);
        behind.world_from_camera = Pose::from_twist(&[0.0, 0.0, 4.0, 0.0, PI, 0.0]);
        let both = observed_part(&mesh, [view(&depth), behind], protocol, Keep::AllSeen);
        assert!(both.positions.iter().any(|p| p[2] == 2.0));
        assert!(observed_part(&mesh, [behind], protocol, Keep::AnySeen).positions.is_empty());
        // By the frustum alone the hidden wall stays, too, and needs no virtual view.
        let frustum = observed_part(&mesh, [view(&depth)], CullProtocol::Frustum, Keep::AllSeen);
        let far = |m: &Mesh| m.positions.iter().filter(|p| p[2] == 2.0).count();
        assert!(far(&frustum) >= far(&both) && far(&both) > 0 && far(&part) == 0);
        assert!(frustum.positions.iter().all(|p| p[0].abs() < 1.1));
    }

    #[test]
    fn a_cube_seen_from_outside_loses_the_faces_behind() {
        // One camera before a face, one virtual before another.
        let mut cube = Mesh::default();
        for axis in 0..3 {
            for z in [0.0, 1.0] {
                let face = square(20, 1.0, z);
                let offset = cube.positions.len() as u32;
                let turn = |p: &[f32; 3]| core::array::from_fn(|a| p[(a + axis) % 3] - 0.5);
                cube.positions.extend(face.positions.iter().map(turn));
                cube.triangles.extend(face.triangles.iter().map(|t| t.map(|i| i + offset)));
            }
        }
        let protocol = CullProtocol::RenderedDepth { tolerance_m: 0.03 };
        let depth = vec![1u16; 1600];
        let mut front = view(&depth);
        front.world_from_camera.translation = DVec3::new(0.0, 0.0, -3.0);
        let part = |views: &[CullingView<'_>], p| {
            observed_part(&cube, views.iter().copied(), p, Keep::AllSeen)
        };
        // A vertex on the silhouette may fall on a pixel that shows nothing.
        let seen = part(&[front], protocol);
        assert!((0.8..=1.0 + 1e-6).contains(&seen.area()), "{}", seen.area());
        assert!(seen.positions.iter().all(|p| p[2] == -0.5));
        assert!((part(&[front], CullProtocol::Frustum).area() - 6.0).abs() < 1e-5);
        // From +x, looking along -x.
        let mut side = view(&[]);
        side.world_from_camera = Pose::from_twist(&[3.0, 0.0, 0.0, 0.0, -PI / 2.0, 0.0]);
        let both = part(&[front, side], protocol);
        assert!((1.6..=2.0 + 1e-6).contains(&both.area()), "{}", both.area());
        assert!(both.positions.iter().all(|p| p[2] == -0.5 || p[0] == 0.5));
    }
}
