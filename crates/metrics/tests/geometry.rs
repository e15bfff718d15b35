//! Properties of the geometry that must hold for any input, tried on random ones. The generator is
//! seeded, so that what fails once fails again; a message names the case.
use glam::{DMat3, DQuat, DVec3};
use mte_slam_mesh::{BlockMesher, DepthRenderer, Mesh, rasterise};
use mte_slam_metrics::{
    PosePair, SurfaceOptions, align_rigid, ate, depth_l1, depth_views, evaluate_surface, icp,
};
use mte_slam_types::{camera::Camera, frame::Bounds, pose::Pose};
use std::collections::HashMap;

/// A linear congruential generator (Knuth's MMIX), its high bits.
struct Lcg(u64);

impl Lcg {
    fn unit(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, half: f64) -> f64 {
        half * (2.0 * self.unit() - 1.0)
    }

    fn point(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.within(half), self.within(half), self.within(half))
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.point(1.0);
            if (0.1..1.0).contains(&p.length()) {
                return p.normalize();
            }
        }
    }

    fn pose(&mut self, reach: f64) -> Pose {
        let axis = self.direction() * (std::f64::consts::PI * self.unit());
        let t = self.point(reach);
        Pose::from_twist(&[t.x, t.y, t.z, axis.x, axis.y, axis.z])
    }
}

/// How far two poses are apart, metres and radians added.
fn apart(a: &Pose, b: &Pose) -> f64 {
    let rest = a.inverse().compose(b);
    rest.translation.length() + rest.angle_rad()
}

#[test]
fn poses_are_a_group() {
    let mut g = Lcg(1);
    for case in 0..500 {
        let (a, b, c) = (g.pose(5.0), g.pose(5.0), g.pose(5.0));
        let p = g.point(3.0);
        assert!(apart(&a.compose(&a.inverse()), &Pose::IDENTITY) < 1e-12, "case {case}");
        assert!(apart(&a.inverse().compose(&a), &Pose::IDENTITY) < 1e-12, "case {case}");
        let (left, right) = (a.compose(&b).compose(&c), a.compose(&b.compose(&c)));
        assert!(apart(&left, &right) < 1e-12, "case {case}");
        assert!(apart(&a.compose(&b).inverse(), &b.inverse().compose(&a.inverse())) < 1e-12);
        let both = a.compose(&b).transform_point(p);
        assert!((both - a.transform_point(b.transform_point(p))).length() < 1e-12, "case {case}");
        assert!((a.inverse().transform_point(a.transform_point(p)) - p).length() < 1e-12);
        // Distances and angles stay.
        let (q, r) = (g.point(3.0), g.point(3.0));
        let moved = a.transform_point(q) - a.transform_point(r);
        assert!((moved.length() - (q - r).length()).abs() < 1e-12, "case {case}");
        assert!((a.rotation.determinant() - 1.0).abs() < 1e-12, "case {case}");
        // Every form gives the pose back.
        let matrix = Pose::from_row_major(&a.to_row_major()).unwrap();
        let quaternion = Pose::from_quaternion(a.translation, a.quaternion());
        assert!(apart(&matrix, &a) < 1e-7 && apart(&quaternion, &a) < 1e-7, "case {case}");
        let flipped = a.with_flipped_camera();
        assert!(apart(&flipped.with_flipped_camera(), &a) == 0.0 || flipped != a);
    }
}

#[test]
fn the_exponential_of_a_rotation_vector_is_that_rotation() {
    let mut g = Lcg(2);
    for case in 0..500 {
        let (axis, t) = (g.direction(), g.point(2.0));
        // Very small angles, too.
        let angle = (std::f64::consts::PI - 1e-6) * g.unit().powi(1 + case % 9);
        let w = axis * angle;
        let pose = Pose::from_twist(&[t.x, t.y, t.z, w.x, w.y, w.z]);
        assert!((pose.angle_rad() - angle).abs() < 1e-9, "case {case}: {angle}");
        // The logarithm, by the quaternion, is the rotation vector again.
        let q = pose.quaternion();
        let q = if q.w < 0.0 { -q } else { q };
        let v = DVec3::new(q.x, q.y, q.z);
        let log = if v.length() > 0.0 { v.normalize() * pose.angle_rad() } else { v };
        assert!((log - w).length() < 1e-8, "case {case}: {log} {w}");
        assert!((pose.transform_vector(axis) - axis).length() < 1e-12, "the axis stays");
        let back = Pose::from_twist(&[0.0, 0.0, 0.0, -w.x, -w.y, -w.z]);
        assert!((pose.rotation * back.rotation).abs_diff_eq(DMat3::IDENTITY, 1e-12));
        // Rodrigues by the series of the matrix exponential.
        let k = DMat3::from_cols(
            DVec3::new(0.0, w.z, -w.y),
            DVec3::new(-w.z, 0.0, w.x),
            DVec3::new(w.y, -w.x, 0.0),
        );
        let (mut term, mut sum) = (DMat3::IDENTITY, DMat3::IDENTITY);
        for n in 1..40 {
            term = term * k * (1.0 / f64::from(n));
            sum += term;
        }
        assert!(pose.rotation.abs_diff_eq(sum, 1e-11), "case {case}");
        // A retraction by a twist multiplies from the left and adds to the translation.
        let base = g.pose(2.0);
        let moved = base.retract(&[t.x, t.y, t.z, w.x, w.y, w.z]);
        assert!(moved.rotation.abs_diff_eq(pose.rotation * base.rotation, 1e-11));
        assert!((moved.translation - base.translation - t).length() < 1e-12);
    }
}

#[test]
fn the_rigid_alignment_finds_any_motion() {
    let mut g = Lcg(3);
    for case in 0..200 {
        let motion = g.pose(10.0);
        let n = 3 + (g.unit() * 60.0) as usize;
        let source: Vec<DVec3> = (0..n).map(|_| g.point(2.0)).collect();
        let exact: Vec<DVec3> = source.iter().map(|p| motion.transform_point(*p)).collect();
        let found = align_rigid(&source, &exact).unwrap();
        assert!(found.unique, "case {case}");
        assert!(apart(&found.target_from_source, &motion) < 1e-6, "case {case} of {n}");
        // With noise no other motion near it is better.
        let noisy: Vec<DVec3> = exact.iter().map(|p| *p + g.point(0.05)).collect();
        let best = align_rigid(&source, &noisy).unwrap().target_from_source;
        let cost = |pose: &Pose| -> f64 {
            source
                .iter()
                .zip(&noisy)
                .map(|(s, t)| (pose.transform_point(*s) - *t).length_squared())
                .sum()
        };
        for _ in 0..20 {
            let twist: [f64; 6] = std::array::from_fn(|_| g.within(0.02));
            assert!(cost(&best) <= cost(&best.retract(&twist)) + 1e-12, "case {case}");
        }
        assert!(cost(&best) <= cost(&motion) + 1e-12, "case {case}");
        // A trajectory's error does not depend on the world that it is told in.
        let pairs = |world: &Pose| -> Vec<PosePair> {
            source
                .iter()
                .zip(&noisy)
                .map(|(s, t)| {
                    let estimate = Pose { rotation: DMat3::IDENTITY, translation: *s };
                    let truth = Pose { rotation: DMat3::IDENTITY, translation: *t };
                    PosePair { estimate: world.compose(&estimate), truth }
                })
                .collect()
        };
        let (a, b) = (ate(&pairs(&Pose::IDENTITY)).unwrap(), ate(&pairs(&g.pose(9.0))).unwrap());
        assert!((a.aligned_cm.rmse - b.aligned_cm.rmse).abs() < 1e-6, "case {case}");
        assert!((a.aligned_cm.rmse - 100.0 * (cost(&best) / n as f64).sqrt()).abs() < 1e-6);
    }
    // Points on a line leave a turn about it open, and that is said.
    let line: Vec<DVec3> = (0..9).map(|i| DVec3::new(1.0, 2.0, 3.0) * f64::from(i)).collect();
    assert!(!align_rigid(&line, &line).unwrap().unique);
}

#[test]
fn projection_and_back_projection_are_inverse() {
    let mut g = Lcg(4);
    for case in 0..500 {
        let camera = Camera {
            width: 640,
            height: 480,
            fx: 200.0 + 600.0 * g.unit(),
            fy: 200.0 + 600.0 * g.unit(),
            cx: 300.0 + g.within(40.0),
            cy: 240.0 + g.within(40.0),
        };
        let (u, v, z) = (g.unit() * 640.0, g.unit() * 480.0, 0.01 + 20.0 * g.unit());
        let p = camera.back_project(u, v, z);
        let uv = camera.project(p).unwrap();
        assert!((uv.x - u).abs() < 1e-9 && (uv.y - v).abs() < 1e-9 && p.z == z, "case {case}");
        assert!(camera.project(-p).is_none());
        // A smaller image's pixel shows the middle of its block.
        let (small, i) = (camera.downscaled(4), (u / 4.0).floor());
        let q = small.project(p).unwrap();
        assert!((q.x - (u - 1.5) / 4.0).abs() < 1e-9, "case {case} {i}");
    }
}

/// Returns depth of the nearest triangle along a pixel's ray, by Möller and Trumbore's test of each one, and
/// by how much (in barycentric coordinates) the nearest decision was taken.
fn cast(mesh: &Mesh, camera: &Camera, pose: &Pose, u: usize, v: usize) -> (f64, f64) {
    let d = pose.transform_vector(camera.back_project(u as f64, v as f64, 1.0));
    let (mut best, mut margin) = (f64::INFINITY, f64::INFINITY);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let (e, f) = (b - a, c - a);
        let h = d.cross(f);
        let det = e.dot(h);
        if det.abs() < 1e-12 {
            continue;
        }
        let s = pose.translation - a;
        let (x, q) = (s.dot(h) / det, s.cross(e));
        let y = d.dot(q) / det;
        let z = f.dot(q) / det;
        let inside = x.min(y).min(1.0 - x - y);
        if z > 0.0 {
            margin = margin.min(inside.abs());
        }
        // The near plane at 1 cm.
        if inside >= 0.0 && z > 0.01 {
            best = best.min(z);
        }
    }
    (best, margin)
}

#[test]
fn rendered_depth_is_that_of_rays_cast_at_every_triangle() {
    let mut g = Lcg(5);
    let camera = Camera { width: 40, height: 30, fx: 25.0, fy: 27.0, cx: 19.2, cy: 14.9 };
    let (mut compared, mut surfaces) = (0, 0);
    for case in 0..30 {
        let mut mesh = Mesh::default();
        for t in 0..90 {
            let at = g.point(3.0);
            let size = 0.05 + 2.0 * g.unit() * g.unit();
            for _ in 0..3 {
                mesh.positions.push((at + g.point(size)).to_array().map(|x| x as f32));
            }
            mesh.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
        }
        let pose = g.pose(1.0);
        let depth = DepthRenderer::new(&mesh).depth_m(&camera, &pose, f64::INFINITY);
        assert_eq!(depth, rasterise(&mesh, &camera, &pose).depth_m, "case {case}");
        for v in 0..30 {
            for u in 0..40 {
                let (expected, margin) = cast(&mesh, &camera, &pose, u, v);
                // A centre on an edge belongs to either side.
                if margin < 1e-4 {
                    continue;
                }
                let found = f64::from(depth[v * 40 + u]);
                let expected = if expected.is_finite() { expected } else { 0.0 };
                let close = (found - expected).abs() < 1e-3 * expected.max(0.1);
                assert!(close, "case {case}, pixel {u} {v}: {found} {expected}");
                compared += 1;
                surfaces += usize::from(expected > 0.0);
            }
        }
    }
    assert!(compared > 25_000 && surfaces > 4_000, "{surfaces} of {compared}");
}

/// Returns a smooth random field, positive at the border of the box.
fn field(g: &mut Lcg) -> impl Fn(DVec3) -> f64 + use<> {
    let waves: Vec<(DVec3, f64, f64)> =
        (0..6).map(|_| (g.point(6.0), g.unit() * 6.3, 0.1 + 0.2 * g.unit())).collect();
    move |p: DVec3| {
        let wave: f64 = waves.iter().map(|(k, phase, a)| a * (p.dot(*k) + phase).sin()).sum();
        let border = 0.95 - p.abs().max_element();
        // Below the waves everywhere near the border.
        (p.length() - 0.6 + wave).max(-4.0 * border)
    }
}

#[test]
fn meshes_of_random_smooth_fields_are_watertight() {
    let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
    let mut g = Lcg(6);
    for case in 0..12 {
        let f = field(&mut g);
        let mut mesher = BlockMesher::with_block_cells(bounds, 0.07, 3 + case % 7).unwrap();
        let mut inside = 0;
        while let Some(block) = mesher.next_block() {
            let d: Vec<f32> = (0..block.points()).map(|i| f(block.point(i)) as f32).collect();
            inside += d.iter().filter(|d| **d < 0.0).count();
            mesher.add_block(&block, &d).unwrap();
        }
        let mesh = mesher.finish();
        assert!(inside > 50 && !mesh.triangles.is_empty(), "case {case}");
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        let mut volume = 0.0;
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
                assert_ne!(a, b, "case {case}");
                *edges.entry((a, b)).or_default() += 1;
            }
            let [a, b, c] = mesh.corners(t);
            volume += a.dot(b.cross(c)) / 6.0;
        }
        // Each edge is walked once in each direction.
        for ((a, b), n) in &edges {
            assert!(*n == 1 && edges.get(&(*b, *a)) == Some(&1), "case {case}: edge {a} {b}: {n}");
        }
        assert!(volume > 0.0, "case {case}: it winds outwards");
        for p in &mesh.positions {
            let p = DVec3::from_array(p.map(f64::from));
            assert!(f(p).abs() < 0.15, "case {case}: {p} is off the surface by {}", f(p));
        }
    }
}

/// Returns a wavy closed surface about the origin.
fn blob(seed: u64) -> Mesh {
    let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
    let f = field(&mut Lcg(seed));
    let mut mesher = BlockMesher::new(bounds, 0.05).unwrap();
    while let Some(block) = mesher.next_block() {
        let d: Vec<f32> = (0..block.points()).map(|i| f(block.point(i)) as f32).collect();
        mesher.add_block(&block, &d).unwrap();
    }
    mesher.finish()
}

#[test]
fn figures_of_a_mesh_do_not_depend_on_its_world() {
    let (truth, mut estimate) = (blob(7), blob(7));
    estimate.transform(&Pose { translation: DVec3::new(0.01, -0.005, 0.02), ..Pose::IDENTITY });
    let options = SurfaceOptions { samples: 20_000, ..SurfaceOptions::default() };
    let here = evaluate_surface(&estimate, &truth, &options).unwrap().point_to_surface;
    // A shift of d moves a surface by |d . n|: between nothing and d, half of it on the whole.
    let shift = 100.0 * DVec3::new(0.01, -0.005, 0.02).length();
    for figure in [here.accuracy_cm, here.completion_cm] {
        assert!(figure > 0.3 * shift && figure < 0.8 * shift, "{figure} of {shift}");
    }
    let mut g = Lcg(8);
    for case in 0..5 {
        let world = g.pose(4.0);
        let (mut a, mut b) = (estimate.clone(), truth.clone());
        a.transform(&world);
        b.transform(&world);
        let there = evaluate_surface(&a, &b, &options).unwrap().point_to_surface;
        assert!((there.accuracy_cm - here.accuracy_cm).abs() < 0.01, "case {case}");
        assert!((there.completion_cm - here.completion_cm).abs() < 0.01, "case {case}");
        let found = icp(&a, &b, 0.1, case).unwrap();
        a.transform(&found);
        let aligned = evaluate_surface(&a, &b, &options).unwrap().point_to_surface;
        assert!(aligned.accuracy_cm < 0.1 * here.accuracy_cm, "case {case}: {aligned:?}");
    }
}

#[test]
fn a_mesh_moved_along_a_view_changes_its_depth_by_that() {
    // A wall seen straight on; only the views' poses are taken from the protocol's record.
    let mut wall = Mesh::default();
    for y in 0..=1 {
        for x in 0..=1 {
            wall.positions.push([40.0 * x as f32 - 20.0, 40.0 * y as f32 - 20.0, 5.0]);
        }
    }
    wall.triangles = vec![[0, 1, 3], [0, 3, 2]];
    let camera = Camera { width: 4, height: 4, fx: 0.5, fy: 0.5, cx: 1.5, cy: 1.5 };
    let mut views = depth_views(&wall, &wall, &camera, &[Pose::IDENTITY], 1, 0).unwrap();
    let mut g = Lcg(9);
    for case in 0..10 {
        let turn = DQuat::from_rotation_z(g.within(3.0));
        views.poses = vec![Pose::from_quaternion(DVec3::new(g.within(1.0), 0.0, 1.0), turn)];
        let shift = g.within(0.5);
        let mut moved = wall.clone();
        moved.positions.iter_mut().for_each(|p| p[2] += shift as f32);
        let r = depth_l1(&moved, &wall, &views).unwrap();
        assert!((r.l1_cm - 100.0 * shift.abs()).abs() < 1e-3, "case {case}: {} {shift}", r.l1_cm);
        assert!((r.l1_of_both_cm - r.l1_cm).abs() < 1e-9 && r.missing_percent == 0.0);
    }
}
