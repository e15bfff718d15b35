//! Views that no camera took: those that help Co-SLAM's culling, and depth L1 by virtual views of
//! two meshes. All are drawn from a seed, so that everybody can draw the same.
use super::{MetricsError, surface::sample_surface};
use alloc::{format, string::String, vec::Vec};
use glam::{DMat3, DVec2, DVec3};
use mte_slam_mesh::{DepthRenderer, Mesh, in_any_frustum};
use mte_slam_types::{camera::Camera, maths::Random, parallel, pose::Pose};
use serde::Serialize;

/// The camera of depth L1 by virtual views.
pub const VIRTUAL_CAMERA: Camera =
    Camera { width: 500, height: 500, fx: 300.0, fy: 300.0, cx: 249.5, cy: 249.5 };
/// Surfaces further away are not drawn \[m\].
const FAR_M: f64 = 20.0;
/// Pixels whose true depth is not below this do not count \[m\].
const MAX_DEPTH_M: f32 = 19.0;
/// A view with no more true pixels than this does not count.
const MIN_PIXELS: u64 = 100;
/// Parts of the true mesh's box, from its shortest side to its longest, that views start from.
const BOX_PARTS: [f64; 3] = [0.3, 0.7, 0.7];
/// How far that part is moved up \[m\].
const BOX_LIFT_M: f64 = 0.4;
/// Poses tried for each view that is wanted, at most.
const TRIES_A_VIEW: usize = 500;
/// Samples of the true surface that may be unseen.
const UNSEEN_SAMPLES: usize = 200_000;
/// Streams of the seed; 0 to 4 are those of the surface samples.
const STREAM_UNSEEN: u32 = 5;
const STREAM_DEPTH_VIEWS: u32 = 6;
const STREAM_CULLING_VIEWS: u32 = 7;

/// Returns a camera at `eye` that looks along `forward`, `up` being up in its image; `None` when they are
/// parallel.
fn look(eye: DVec3, forward: DVec3, up: DVec3) -> Option<Pose> {
    let z = forward.try_normalize()?;
    let x = z.cross(up).try_normalize()?;
    Some(Pose { rotation: DMat3::from_cols(x, z.cross(x), z), translation: eye })
}

/// Returns a direction, uniform in a cube about the origin (the peers look at points of one of 20 km).
fn direction(rng: &mut Random) -> DVec3 {
    DVec3::from_array(core::array::from_fn(|_| 2.0 * rng.uniform() - 1.0))
}

/// Virtual views for Co-SLAM's culling, which show what furniture hides from the real ones. The
/// authors placed theirs by hand inside the region of interest; here each starts from free space,
/// which is a point between a real camera and the true surface that it sees (0.2 to 0.8 of the way
/// at a random pixel), and looks in a random direction. Fewer where the poses see no surface.
pub fn culling_views(
    truth: &DepthRenderer<'_>,
    camera: &Camera,
    poses: &[Pose],
    views: usize,
    seed: u32,
) -> Vec<Pose> {
    if poses.is_empty() || camera.pixels() == 0 {
        return Vec::new();
    }
    let found: Vec<Option<Pose>> = parallel::map(views, |i| {
        let mut rng = Random::new(seed, STREAM_CULLING_VIEWS ^ ((i as u32) << 8));
        // Some pixels show no surface, as through a window.
        (0..8).find_map(|_| {
            let pick = |n: usize, u: f64| ((n as f64 * u) as usize).min(n - 1);
            let pose = poses[pick(poses.len(), rng.uniform())];
            let pixel = pick(camera.pixels(), rng.uniform());
            let part = 0.2 + 0.6 * rng.uniform();
            let forward = direction(&mut rng);
            let depth = f64::from(truth.depth_m(camera, &pose, FAR_M)[pixel]);
            let width = camera.width as usize;
            let p = camera.back_project((pixel % width) as f64, (pixel / width) as f64, depth);
            let eye = pose.transform_point(p * part);
            // Down in the image is down for the real camera.
            (depth > 0.0).then(|| look(eye, forward, -pose.rotation.y_axis)).flatten()
        })
    });
    found.into_iter().flatten().collect()
}

/// Views for depth L1, and how they came about.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthViews {
    /// `world_from_camera` of each, with [`VIRTUAL_CAMERA`].
    pub poses: Vec<Pose>,
    /// Views asked for.
    pub wanted: usize,
    /// Poses that were rejected because they see unseen points of the true surface.
    pub rejected: usize,
    /// Samples of the true surface that no frame has in its frustum.
    pub unseen: Vec<[f32; 3]>,
    /// Seed.
    pub seed: u32,
}

/// Draws views for depth L1 as NICE-SLAM does: from inside the box of the culled true mesh (the
/// smallest upright one; its shortest side times 0.3, the others times 0.7, moved up by 0.4 m; z
/// is up), in random directions, without those that have a point in view that no frame had
/// (`whole` is the true mesh before culling, sampled for that). At most 500 poses are tried for
/// each view that is wanted.
///
/// # Errors
/// [`MetricsError::NoSurface`] for a mesh without surface.
pub fn depth_views(
    culled: &Mesh,
    whole: &Mesh,
    camera: &Camera,
    poses: &[Pose],
    wanted: usize,
    seed: u32,
) -> Result<DepthViews, MetricsError> {
    let samples = sample_surface(whole, UNSEEN_SAMPLES, seed, STREAM_UNSEEN, "true")?;
    let seen = in_any_frustum(&samples, camera, poses);
    let unseen: Vec<_> = samples.iter().zip(seen).filter(|(_, s)| !s).map(|(p, _)| *p).collect();
    let Some(room) = UprightBox::around(&culled.positions) else {
        return Err(MetricsError::NoSurface { mesh: "true", found: "no vertices".into() });
    };
    let room = room.scaled(BOX_PARTS);
    let tries = wanted * TRIES_A_VIEW;
    let mut views = DepthViews { poses: Vec::new(), wanted, rejected: 0, unseen, seed };
    let mut tried = 0;
    while views.poses.len() < wanted && tried < tries {
        // In batches, so that threads have something to do.
        let batch = (tries - tried).min(1024);
        let found = parallel::map(batch, |i| {
            let mut rng = Random::new(seed, STREAM_DEPTH_VIEWS ^ (((tried + i) as u32) << 8));
            let at = core::array::from_fn(|_| rng.uniform() - 0.5);
            let eye = room.point(at) + DVec3::Z * BOX_LIFT_M;
            let pose = look(eye, direction(&mut rng), DVec3::Z)?;
            let camera_from_world = pose.inverse();
            let shows = |p: &[f32; 3]| {
                let p = camera_from_world.transform_point(DVec3::from_array(p.map(f64::from)));
                VIRTUAL_CAMERA.project(p).is_some_and(|uv| {
                    let (w, h) =
                        (f64::from(VIRTUAL_CAMERA.width), f64::from(VIRTUAL_CAMERA.height));
                    uv.x > 0.0 && uv.y > 0.0 && uv.x < w && uv.y < h
                })
            };
            (!views.unseen.iter().any(shows)).then_some(pose)
        });
        tried += batch;
        for pose in found {
            match pose {
                Some(pose) if views.poses.len() < wanted => views.poses.push(pose),
                Some(_) => break,
                None => views.rejected += 1,
            }
        }
    }
    Ok(views)
}

/// Depth L1 of a mesh by virtual views.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshDepthReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]); the caller names how the meshes were
    /// culled and aligned.
    pub protocol_id: String,
    /// What the figures mean; the caller adds how the meshes were culled and aligned.
    pub protocol: String,
    /// Views that count.
    pub views: usize,
    /// Views asked for.
    pub wanted_views: usize,
    /// Poses that were rejected because they see unseen points of the true surface.
    pub rejected_views: usize,
    /// Seed.
    pub seed: u32,
    /// Pixels with a true depth, over all views.
    pub pixels: u64,
    /// Mean over the views of each one's mean |estimate - truth| \[cm\]; a pixel in which only the
    /// truth has a surface counts with its whole depth, as with the peers.
    pub l1_cm: f64,
    /// The same over the pixels in which both have a surface \[cm\].
    pub l1_of_both_cm: f64,
    /// Share of the true pixels in which the estimate has no surface \[%\].
    pub missing_percent: f64,
}

/// What one view shows.
#[derive(Default)]
struct ViewSums {
    /// Pixels with a true depth.
    pixels: u64,
    /// Those in which the estimate has one, too.
    both: u64,
    /// Sum of |estimate - truth| over these.
    error_m: f64,
    /// Sum of the true depth over the others.
    missing_m: f64,
}

impl ViewSums {
    fn of(truth: &[f32], estimate: &[f32]) -> ViewSums {
        let mut v = ViewSums::default();
        for (&t, &e) in truth.iter().zip(estimate).filter(|(t, _)| **t > 0.0 && **t < MAX_DEPTH_M) {
            v.pixels += 1;
            if e > 0.0 {
                v.both += 1;
                v.error_m += f64::from((e - t).abs());
            } else {
                v.missing_m += f64::from(t);
            }
        }
        v
    }
}

/// Compares the depth of two meshes, both culled alike, in virtual views.
///
/// # Errors
/// [`MetricsError::NoSurface`] for a broken mesh; [`MetricsError::NoViews`] when no view counts.
pub fn depth_l1(
    estimate: &Mesh,
    truth: &Mesh,
    views: &DepthViews,
) -> Result<MeshDepthReport, MetricsError> {
    for (mesh, which) in [(estimate, "estimated"), (truth, "true")] {
        mesh.check().map_err(|e| MetricsError::NoSurface { mesh: which, found: format!("{e}") })?;
    }
    let (ours, theirs) = (DepthRenderer::new(estimate), DepthRenderer::new(truth));
    let all = parallel::map(views.poses.len(), |i| {
        let truth = theirs.depth_m(&VIRTUAL_CAMERA, &views.poses[i], FAR_M);
        let estimate = ours.depth_m(&VIRTUAL_CAMERA, &views.poses[i], FAR_M);
        ViewSums::of(&truth, &estimate)
    });
    let counted: Vec<ViewSums> = all.into_iter().filter(|v| v.pixels > MIN_PIXELS).collect();
    if counted.is_empty() {
        let (wanted, rejected) = (views.wanted, views.rejected);
        return Err(MetricsError::NoViews { wanted, rejected });
    }
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let pixels: u64 = counted.iter().map(|v| v.pixels).sum();
    let both: u64 = counted.iter().map(|v| v.both).sum();
    let of_all = |v: &ViewSums| (v.error_m + v.missing_m) / v.pixels as f64;
    let of_both = |v: &ViewSums| (v.both > 0).then(|| v.error_m / v.both as f64);
    Ok(MeshDepthReport {
        protocol_id: crate::protocol::depth_virtual(views.wanted),
        protocol: format!(
            "Depth L1, mesh: both meshes in {} virtual views 500x500, f 300, far 20 m, inside the \
             true mesh's upright box x (0.3, 0.7, 0.7) + 0.4 m in z, views of unseen true points \
             rejected, pixels 0 < true < 19 m, mean over views of means; no surface counts as \
             depth 0 (NICE-SLAM, Co-SLAM)",
            counted.len()
        ),
        views: counted.len(),
        wanted_views: views.wanted,
        rejected_views: views.rejected,
        seed: views.seed,
        pixels,
        l1_cm: 100.0 * mean(counted.iter().map(of_all).collect()),
        l1_of_both_cm: 100.0 * mean(counted.iter().filter_map(of_both).collect()),
        missing_percent: 100.0 * (pixels - both) as f64 / pixels as f64,
    })
}

/// A box standing upright (z up).
#[derive(Clone, Copy, Debug)]
struct UprightBox {
    centre: DVec3,
    axes: [DVec3; 3],
    /// Lengths along the axes \[m\].
    sides: [f64; 3],
}

impl UprightBox {
    /// Returns the smallest such box around points, by the least area seen from above; `None` without
    /// finite points.
    fn around(points: &[[f32; 3]]) -> Option<UprightBox> {
        let finite = || points.iter().filter(|p| p.iter().all(|x| x.is_finite()));
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (low.min(f64::from(p[2])), high.max(f64::from(p[2])))
        });
        let hull = convex_hull(finite().map(|p| DVec2::new(p[0].into(), p[1].into())).collect());
        let mut best: Option<(f64, UprightBox)> = None;
        for (i, &from) in hull.iter().enumerate() {
            // A side of the smallest rectangle lies on one of the hull's.
            let along = (hull[(i + 1) % hull.len()] - from).try_normalize().unwrap_or(DVec2::X);
            let across = along.perp();
            let extent = |axis: DVec2| {
                hull.iter()
                    .map(|p| p.dot(axis))
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
            };
            let (a, b) = (extent(along), extent(across));
            let area = (a.1 - a.0) * (b.1 - b.0);
            if best.as_ref().is_none_or(|(least, _)| area < *least) {
                let middle = along * (0.5 * (a.0 + a.1)) + across * (0.5 * (b.0 + b.1));
                let found = UprightBox {
                    centre: middle.extend(0.5 * (low + high)),
                    axes: [along.extend(0.0), across.extend(0.0), DVec3::Z],
                    sides: [a.1 - a.0, b.1 - b.0, high - low],
                };
                best = Some((area, found));
            }
        }
        best.map(|(_, found)| found)
    }

    /// The same box with its sides, shortest first, times `parts`.
    fn scaled(mut self, parts: [f64; 3]) -> UprightBox {
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| self.sides[a].total_cmp(&self.sides[b]));
        for (axis, part) in order.into_iter().zip(parts) {
            self.sides[axis] *= part;
        }
        self
    }

    /// Returns the point at `at`, each from -0.5 to 0.5.
    fn point(&self, at: [f64; 3]) -> DVec3 {
        (0..3).fold(self.centre, |p, a| p + self.axes[a] * (self.sides[a] * at[a]))
    }
}

/// Returns the corners of the convex hull, counter-clockwise.
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull: Vec<DVec2> = Vec::new();
    // Lower chain from left to right, then the upper one back.
    for pass in 0..2 {
        let start = hull.len();
        let turn = |hull: &mut Vec<DVec2>, p: DVec2| {
            while hull.len() >= start + 2 {
                let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        };
        if pass == 0 {
            points.iter().for_each(|&p| turn(&mut hull, p));
        } else {
            points.iter().rev().for_each(|&p| turn(&mut hull, p));
        }
        // The last of a chain is the first of the next.
        hull.pop();
    }
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;
    use alloc::vec;

    /// Returns the inside of a room of 6 x 4 x 3 m centred on the origin but for z, turned about z.
    fn room(turn: f64) -> Mesh {
        let size = [6.0f32, 4.0, 3.0];
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                let face = square(24, 1.0, side);
                let offset = mesh.positions.len() as u32;
                let place = |p: &[f32; 3]| {
                    let q: [f32; 3] = core::array::from_fn(|a| p[(a + axis) % 3]);
                    [(q[0] - 0.5) * size[0], (q[1] - 0.5) * size[1], q[2] * size[2]]
                };
                mesh.positions.extend(face.positions.iter().map(place));
                mesh.triangles.extend(face.triangles.iter().map(|t| t.map(|i| i + offset)));
            }
        }
        mesh.transform(&Pose::from_twist(&[0.5, -0.3, 0.0, 0.0, 0.0, turn]));
        mesh
    }

    /// Returns a camera in the middle of the room that looks level at `degrees` from x.
    fn level(degrees: f64) -> Pose {
        let a = degrees.to_radians();
        let eye = DVec3::new(0.5, -0.3, 1.5);
        look(eye, DVec3::new(num_traits::Float::cos(a), num_traits::Float::sin(a), 0.0), DVec3::Z)
            .unwrap()
    }

    /// Such cameras that see everything together.
    fn all_round() -> Vec<Pose> {
        let eye = level(0.0).translation;
        let upright = [DVec3::Z, -DVec3::Z].map(|d| look(eye, d, DVec3::X).unwrap());
        (0..8).map(|k| level(45.0 * f64::from(k))).chain(upright).collect()
    }

    const WIDE: Camera = Camera { width: 64, height: 64, fx: 12.0, fy: 12.0, cx: 31.5, cy: 31.5 };

    #[test]
    fn the_box_of_a_turned_room_is_found() {
        let b = UprightBox::around(&room(0.4).positions).unwrap();
        let mut sides = b.sides;
        sides.sort_by(f64::total_cmp);
        for (found, expected) in sides.iter().zip([3.0, 4.0, 6.0]) {
            assert!((found - expected).abs() < 1e-4, "{sides:?}");
        }
        assert!((b.centre - DVec3::new(0.5, -0.3, 1.5)).length() < 1e-4, "{b:?}");
        // The shortest side is the height here, whatever the order of the axes.
        let s = b.scaled(BOX_PARTS);
        assert!((s.sides[2] - 0.9).abs() < 1e-4, "{s:?}");
        let corner = room(0.4).positions[0].map(f64::from);
        let inverse = b.axes.map(|a| a.dot(DVec3::from_array(corner) - b.centre));
        assert!(inverse.iter().zip(b.sides).all(|(x, s)| x.abs() <= 0.5 * s + 1e-4));
        assert!(UprightBox::around(&[]).is_none());
        assert!(UprightBox::around(&[[f32::NAN; 3]]).is_none());
    }

    #[test]
    fn a_room_against_itself_and_grown() {
        let truth = room(0.4);
        let poses = all_round();
        let views = depth_views(&truth, &truth, &WIDE, &poses, 30, 3).unwrap();
        assert_eq!((views.poses.len(), views.unseen.len(), views.rejected), (30, 0, 0));
        assert_eq!(views, depth_views(&truth, &truth, &WIDE, &poses, 30, 3).unwrap());
        let other = depth_views(&truth, &truth, &WIDE, &poses, 30, 4).unwrap();
        assert_ne!(views.poses, other.poses);
        for p in &views.poses {
            let height = p.translation.z - 1.9;
            assert!(height.abs() <= 0.45 + 1e-9, "{height}");
            assert!(p.rotation.y_axis.z < 0.0, "down in the image is down");
        }
        let same = depth_l1(&truth, &truth, &views).unwrap();
        assert_eq!((same.l1_cm, same.missing_percent, same.views), (0.0, 0.0, 30));
        assert_eq!(same.pixels, 30 * 250_000);
        // Grown about each eye by 2 %: every depth is, too. One view after the other.
        let mut sums = (0.0, 0.0);
        for pose in &views.poses {
            let mut grown = truth.clone();
            for p in &mut grown.positions {
                let q = DVec3::from_array(p.map(f64::from));
                let q = pose.translation + (q - pose.translation) * 1.02;
                *p = q.to_array().map(|x| x as f32);
            }
            let one = DepthViews { poses: vec![*pose], ..views.clone() };
            sums.0 += depth_l1(&grown, &truth, &one).unwrap().l1_cm;
            let depth = DepthRenderer::new(&truth).depth_m(&VIRTUAL_CAMERA, pose, FAR_M);
            sums.1 += depth.iter().map(|d| f64::from(*d)).sum::<f64>() / depth.len() as f64;
        }
        assert!((sums.0 - 2.0 * sums.1).abs() < 1e-3 * sums.0, "{sums:?}");
    }

    #[test]
    fn what_is_missing_costs_its_depth() {
        let truth = room(0.0);
        let poses = all_round();
        let mut views = depth_views(&truth, &truth, &WIDE, &poses, 1, 3).unwrap();
        // Straight at the wall in +x, 3 m away, 500 / 300 * 3 = 5 m wide and high: it fills 4 x 3
        // of that.
        views.poses = vec![level(0.0)];
        let mut open = truth.clone();
        let far = |t: usize| truth.corners(t).iter().all(|p| p.x > 3.49);
        open.retain_triangles(|t| !far(t));
        let r = depth_l1(&open, &truth, &views).unwrap();
        let share = 4.0 * 3.0 / 25.0;
        assert!((r.missing_percent / 100.0 - share).abs() < 0.01, "{r:?}");
        assert!((r.l1_cm - 300.0 * share).abs() < 3.0, "{r:?}");
        assert_eq!(r.l1_of_both_cm, 0.0);
        // The other way round the hole is not looked at.
        let r = depth_l1(&truth, &open, &views).unwrap();
        assert_eq!((r.l1_cm, r.missing_percent), (0.0, 0.0));
    }

    #[test]
    fn views_of_unseen_points_are_rejected() {
        let truth = room(0.0);
        // One narrow look at +x: everything else is unseen, and in every view that is drawn.
        let narrow = Camera { fx: 60.0, fy: 60.0, ..WIDE };
        let none = depth_views(&truth, &truth, &narrow, &[level(0.0)], 2, 1).unwrap();
        assert!(none.poses.is_empty() && none.rejected == 2 * TRIES_A_VIEW);
        assert!(none.unseen.len() > UNSEEN_SAMPLES / 2);
        let e = depth_l1(&truth, &truth, &none).unwrap_err();
        assert_eq!(e, MetricsError::NoViews { wanted: 2, rejected: 2 * TRIES_A_VIEW });
        // All but the wall in -x is seen: views that hold a point of it are rejected.
        let half: Vec<Pose> = (-2..=2).map(|k| level(35.0 * f64::from(k))).collect();
        let views = depth_views(&truth, &truth, &WIDE, &half, 40, 1).unwrap();
        assert!(views.rejected > 0 && views.poses.len() == 40, "{}", views.rejected);
        assert!(!views.unseen.is_empty());
        for pose in &views.poses {
            let inverse = pose.inverse();
            for p in &views.unseen {
                let p = inverse.transform_point(DVec3::from_array(p.map(f64::from)));
                let shown = VIRTUAL_CAMERA.project(p);
                assert!(
                    !shown.is_some_and(|uv| uv.min_element() > 0.0 && uv.max_element() < 500.0)
                );
            }
        }
    }

    #[test]
    fn culling_views_start_in_seen_free_space() {
        let truth = room(0.0);
        let renderer = DepthRenderer::new(&truth);
        let poses: Vec<Pose> = (0..4).map(|k| level(90.0 * f64::from(k))).collect();
        let views = culling_views(&renderer, &WIDE, &poses, 50, 9);
        assert_eq!(views.len(), 50);
        assert_eq!(views, culling_views(&renderer, &WIDE, &poses, 50, 9));
        assert_ne!(views, culling_views(&renderer, &WIDE, &poses, 50, 10));
        for v in &views {
            let p = v.translation - DVec3::new(0.5, -0.3, 1.5);
            assert!(p.x.abs() < 2.41 && p.y.abs() < 1.61 && p.z.abs() < 1.21, "{p}");
            assert!((v.rotation.determinant() - 1.0).abs() < 1e-9);
        }
        assert!(views.iter().any(|v| v.rotation.z_axis.z.abs() > 0.5));
        // Poses that see nothing give none.
        let away = Pose { translation: DVec3::splat(99.0), ..Pose::IDENTITY };
        assert!(culling_views(&renderer, &WIDE, &[away], 5, 9).is_empty());
    }
}
