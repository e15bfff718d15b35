//! Corners with binary descriptors and depth: a start for the alignment when frames are far apart
//! (a low frame rate, a lost camera), where coarse levels have slid into a wrong minimum.
use super::{linear::solve_constrained, pyramid::RgbdPyramid};
use alloc::{vec, vec::Vec};
use glam::{DMat3, DVec3};
use mte_slam_types::pose::Pose;

/// Cell side \[pixels\] and most corners in it: corners spread over the image.
const CELL: usize = 20;
const PER_CELL: usize = 4;
/// Pixels around a corner that its descriptor may read.
const REACH: i32 = 13;

#[derive(Clone, Debug)]
struct Corner {
    p: DVec3,
    u: f64,
    v: f64,
    bits: [u64; 4],
}

/// The corners of one frame.
#[derive(Clone, Debug)]
pub(super) struct Corners {
    list: Vec<Corner>,
    focal: f64,
}

/// A pose from matches.
#[derive(Clone, Debug)]
pub(super) struct MatchedPose {
    pub reference_from_current: Pose,
    pub inliers: usize,
}

/// Small deterministic generator (PCG output of a linear congruence).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let x = (((self.0 >> 18) ^ self.0) >> 27) as u32;
        x.rotate_right((self.0 >> 59) as u32)
    }

    fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.next()) * n as u64) >> 32) as usize
    }
}

/// Returns the 256 pixel pairs of the descriptor: sums of uniforms, so mostly near the centre.
fn pattern() -> Vec<[i32; 4]> {
    let mut random = Random(7);
    let mut draw = || {
        let sum: i32 = (0..3).map(|_| random.below(2 * REACH as usize + 1) as i32 - REACH).sum();
        (sum * 2 / 3).clamp(-REACH, REACH)
    };
    (0..256).map(|_| [draw(), draw(), draw(), draw()]).collect()
}

impl Corners {
    pub fn new(pyramid: &RgbdPyramid) -> Corners {
        let level = &pyramid.levels[0];
        let (w, h) = (level.width, level.height);
        let mut out = Corners { list: Vec::new(), focal: f64::from(level.fx) };
        if w < 64 || h < 48 {
            return out;
        }
        // Smaller eigenvalue of the structure tensor over 5x5, by running sums.
        let mut tensor = vec![[0.0f32; 3]; w * h];
        for v in 2..h - 2 {
            for u in 0..w {
                let mut s = [0.0; 3];
                for y in v - 2..=v + 2 {
                    let t = level.texels[y * w + u];
                    s[0] += t[1] * t[1];
                    s[1] += t[1] * t[2];
                    s[2] += t[2] * t[2];
                }
                tensor[v * w + u] = s;
            }
        }
        let mut response = vec![0.0f32; w * h];
        for v in 2..h - 2 {
            for u in 2..w - 2 {
                let mut s = [0.0; 3];
                for x in u - 2..=u + 2 {
                    let t = tensor[v * w + x];
                    (0..3).for_each(|k| s[k] += t[k]);
                }
                let d = 0.5 * (s[0] - s[2]);
                let root = num_traits::Float::sqrt(d * d + s[1] * s[1]);
                response[v * w + u] = 0.5 * (s[0] + s[2]) - root;
            }
        }
        // Descriptors compare blurred pixels.
        let blur = |u: usize, v: usize| {
            let mut sum = 0.0;
            for y in v - 2..=v + 2 {
                for x in u - 2..=u + 2 {
                    sum += level.texels[y * w + x][0];
                }
            }
            sum
        };
        let mut blurred = vec![0.0f32; w * h];
        for v in 2..h - 2 {
            for u in 2..w - 2 {
                blurred[v * w + u] = blur(u, v);
            }
        }
        let pairs = pattern();
        let margin = REACH as usize + 2;
        for top in (margin..h - margin).step_by(CELL) {
            for left in (margin..w - margin).step_by(CELL) {
                let mut cell: Vec<(f32, usize, usize)> = Vec::new();
                for v in top..(top + CELL).min(h - margin) {
                    for u in left..(left + CELL).min(w - margin) {
                        let r = response[v * w + u];
                        if r < 2e-4 || level.texels[v * w + u][3] <= 0.0 {
                            continue;
                        }
                        let peak = (v - 1..=v + 1)
                            .all(|y| (u - 1..=u + 1).all(|x| response[y * w + x] <= r));
                        if peak {
                            cell.push((r, u, v));
                        }
                    }
                }
                cell.sort_by(|a, b| b.0.total_cmp(&a.0));
                for &(_, u, v) in cell.iter().take(PER_CELL) {
                    let z = f64::from(level.texels[v * w + u][3]);
                    let mut bits = [0u64; 4];
                    for (k, [a, b, c, d]) in pairs.iter().enumerate() {
                        let at = |x: i32, y: i32| {
                            blurred[(v as i32 + y) as usize * w + (u as i32 + x) as usize]
                        };
                        if at(*a, *b) < at(*c, *d) {
                            bits[k / 64] |= 1 << (k % 64);
                        }
                    }
                    let (x, y) = (
                        (u as f64 - f64::from(level.cx)) / f64::from(level.fx),
                        (v as f64 - f64::from(level.cy)) / f64::from(level.fy),
                    );
                    out.list.push(Corner { p: DVec3::new(x * z, y * z, z), u: x, v: y, bits });
                }
            }
        }
        out
    }

    /// Mutual nearest neighbours that are clearly better than the second: (own, other).
    fn matches(&self, other: &Corners) -> Vec<(usize, usize)> {
        let nearest = |f: &Corner, list: &[Corner]| {
            let (mut best, mut second, mut at) = (u32::MAX, u32::MAX, 0);
            for (i, g) in list.iter().enumerate() {
                let d: u32 = (0..4).map(|k| (f.bits[k] ^ g.bits[k]).count_ones()).sum();
                if d < best {
                    second = best;
                    best = d;
                    at = i;
                } else if d < second {
                    second = d;
                }
            }
            (best, second, at)
        };
        let mut out = Vec::new();
        for (i, f) in self.list.iter().enumerate() {
            let (best, second, j) = nearest(f, &other.list);
            if best < 70 && f64::from(best) < 0.85 * f64::from(second) {
                let (_, _, back) = nearest(&other.list[j], &self.list);
                if back == i {
                    out.push((i, j));
                }
            }
        }
        out
    }

    /// Pose of `current` relative to this frame from matched corners; `None` with too few that
    /// agree. Deterministic.
    pub fn locate(&self, current: &Corners) -> Option<MatchedPose> {
        let matches = self.matches(current);
        if matches.len() < 8 {
            return None;
        }
        // Three pixels in the image, and depth noise of a stereo-like sensor.
        let tolerance = 3.0 / self.focal;
        let fits = |pose: &Pose, &(i, j): &(usize, usize)| {
            let (a, b) = (&self.list[i], &current.list[j]);
            let q = pose.transform_point(b.p);
            let near = 0.02 * a.p.z + 0.01 * a.p.z * a.p.z;
            q.z > 0.05
                && (q.x / q.z - a.u).abs() < tolerance
                && (q.y / q.z - a.v).abs() < tolerance
                && (q.z - a.p.z).abs() < near
        };
        let mut random = Random(1);
        let mut best: (usize, Pose) = (0, Pose::IDENTITY);
        for _ in 0..400 {
            let pick: [usize; 3] = core::array::from_fn(|_| random.below(matches.len()));
            let a = pick.map(|k| self.list[matches[k].0].p);
            let b = pick.map(|k| current.list[matches[k].1].p);
            let Some(pose) = three_points(&a, &b) else { continue };
            let n = matches.iter().filter(|m| fits(&pose, m)).count();
            if n > best.0 {
                best = (n, pose);
            }
        }
        let (mut n, mut pose) = best;
        for _ in 0..4 {
            let inliers: Vec<&(usize, usize)> = matches.iter().filter(|m| fits(&pose, m)).collect();
            if inliers.len() < 6 {
                return None;
            }
            let pairs = inliers.iter().map(|m| (self.list[m.0].p, current.list[m.1].p));
            let next = refine(&pose, pairs);
            let count = matches.iter().filter(|m| fits(&next, m)).count();
            if count < n {
                break;
            }
            n = count;
            pose = next;
        }
        (n >= 9 && 8 * n >= matches.len())
            .then_some(MatchedPose { reference_from_current: pose, inliers: n })
    }
}

/// Returns the rigid motion that takes triangle b to triangle a, when their sides agree.
fn three_points(a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<Pose> {
    for k in 0..3 {
        let (x, y) = ((a[k] - a[(k + 1) % 3]).length(), (b[k] - b[(k + 1) % 3]).length());
        if x < 0.1 || (x - y).abs() > 0.02 + 0.05 * x {
            return None;
        }
    }
    let frame = |p: &[DVec3; 3]| {
        let x = (p[1] - p[0]).normalize();
        let z = x.cross(p[2] - p[0]);
        (z.length() > 0.02).then(|| {
            let z = z.normalize();
            DMat3::from_cols(x, z.cross(x), z)
        })
    };
    let rotation = frame(a)? * frame(b)?.transpose();
    let (ca, cb) = ((a[0] + a[1] + a[2]) / 3.0, (b[0] + b[1] + b[2]) / 3.0);
    Some(Pose { rotation, translation: ca - rotation * cb })
}

/// Two Gauss-Newton steps on the distances between points, weighted by depth noise along z.
fn refine(start: &Pose, pairs: impl Iterator<Item = (DVec3, DVec3)> + Clone) -> Pose {
    let mut pose = *start;
    for _ in 0..2 {
        let mut h = [[0.0; 6]; 6];
        let mut b = [0.0; 6];
        let mut depth = 0.0;
        let mut n = 0.0;
        for (target, p) in pairs.clone() {
            let rp = pose.rotation * p;
            let e = (rp + pose.translation - target).to_array();
            let z2 = target.z * target.z;
            let across = 1.0 / (4e-5 * z2 + 1e-6);
            let weight = [across, across, 1.0 / (1e-4 * z2 * z2 + 1e-5)];
            // Row k of the Jacobian: unit vector k, then rp x unit vector k.
            let jacobian = [
                [1.0, 0.0, 0.0, 0.0, rp.z, -rp.y],
                [0.0, 1.0, 0.0, -rp.z, 0.0, rp.x],
                [0.0, 0.0, 1.0, rp.y, -rp.x, 0.0],
            ];
            for k in 0..3 {
                for i in 0..6 {
                    for j in 0..6 {
                        h[i][j] += weight[k] * jacobian[k][i] * jacobian[k][j];
                    }
                    b[i] += weight[k] * jacobian[k][i] * e[k];
                }
            }
            depth += target.z;
            n += 1.0;
        }
        let (step, _, _) = solve_constrained(&h, &b, 0.0, depth / f64::max(n, 1.0), 1e-9);
        pose = pose.retract(&step);
    }
    pose
}
