//! Whether depth and poses fit each other: the depth of a frame, moved into a later one by their
//! true poses, must be the depth that is measured there. A wrong unit of depth, other axes or
//! another meaning of the poses make it worse, and the right one better, so all usual ones are tried.
use super::{remark::Severity, summary::median};
use crate::depth_range::USUAL_UNITS;
use glam::DQuat;
use mte_slam_types::{
    camera::Camera,
    frame::SequenceInfo,
    pose::Pose,
    sequence::{Sequence, SequenceError},
};
use serde::Serialize;

/// Points of a frame that are moved, about.
const POINTS: usize = 2500;
/// A later frame is far enough when depth at the same pixels differs by this share there.
const CHANGE: f64 = 0.04;
/// Below this nothing can be said.
const LEAST_CHANGE: f64 = 0.012;
/// How many frames later, at most.
const OFFSETS: [usize; 9] = [1, 2, 3, 5, 8, 12, 20, 30, 45];
/// At least this share of the points must fall on measured depth.
const COVERAGE: f64 = 0.25;
/// An alternative is believed when it leaves less than this share of the disagreement.
const CONVINCING: f64 = 0.6;
/// Nothing is wrong that makes no larger difference.
const GOOD: f64 = 0.004;
/// Depth is interpolated between pixels that differ by no more than this share.
const SURFACE: f64 = 0.05;

/// What the numbers of a pose are taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum PoseReading {
    /// As the reader takes them.
    AsGiven,
    /// With y and z of the camera reversed (OpenGL in place of OpenCV, or back).
    FlippedAxes,
    /// camera_from_world in place of world_from_camera.
    Inverse,
    /// Both.
    InverseFlipped,
    /// Quaternions with the scalar first, where it is read as the last.
    ScalarFirst,
    /// Poses in the lexical order of the frames' numbers (0, 1, 10, 11, 2), not in the numeric.
    LexicalOrder,
}

impl PoseReading {
    const ALL: [PoseReading; 6] = [
        PoseReading::AsGiven,
        PoseReading::FlippedAxes,
        PoseReading::Inverse,
        PoseReading::InverseFlipped,
        PoseReading::ScalarFirst,
        PoseReading::LexicalOrder,
    ];

    /// The pose that is meant by one that was read.
    fn apply(self, pose: &Pose) -> Pose {
        match self {
            PoseReading::AsGiven | PoseReading::LexicalOrder => *pose,
            PoseReading::FlippedAxes => pose.with_flipped_camera(),
            PoseReading::Inverse => pose.inverse(),
            PoseReading::InverseFlipped => pose.inverse().with_flipped_camera(),
            PoseReading::ScalarFirst => {
                // Read as (x, y, z, w), meant as (w, x, y, z).
                let q = pose.quaternion();
                Pose::from_quaternion(pose.translation, DQuat::from_xyzw(q.y, q.z, q.w, q.x))
            }
        }
    }

    fn in_words(self, layout: &str) -> &'static str {
        match self {
            PoseReading::AsGiven => "as given",
            PoseReading::FlippedAxes if layout == "nerfstudio" => {
                "with the camera's axes of OpenCV (y down, z forward) in place of OpenGL's"
            }
            PoseReading::FlippedAxes => {
                "with the camera's axes of OpenGL (y up, z backward) in place of OpenCV's"
            }
            PoseReading::Inverse => "as camera_from_world in place of world_from_camera",
            PoseReading::InverseFlipped => {
                "as camera_from_world, and with the camera's axes of OpenGL"
            }
            PoseReading::ScalarFirst => "as quaternions with the scalar first (w x y z)",
            PoseReading::LexicalOrder => {
                "in the lexical order of the file names (0, 1, 10, 11, 2) in place of the numeric"
            }
        }
    }

    fn cure(self) -> &'static str {
        match self {
            PoseReading::AsGiven => "",
            PoseReading::FlippedAxes => {
                "turn them with --axes opengl (or leave it out where it is given)"
            }
            PoseReading::Inverse => "invert them in the file",
            PoseReading::InverseFlipped => {
                "invert them in the file, and turn them with --axes opengl"
            }
            PoseReading::ScalarFirst => "write them as x y z w",
            PoseReading::LexicalOrder => "write them in numeric order",
        }
    }
}

/// How well depth fits under one reading of the files.
#[derive(Clone, Debug, Serialize)]
pub struct Reading {
    /// What the poses are taken for.
    pub poses: PoseReading,
    /// Units of depth per metre.
    pub depth_scale: f64,
    /// Relative difference of moved and measured depth: the median over points and pairs; 1 where
    /// too few points meet a measurement.
    pub error: f64,
}

/// The outcome.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    /// Pairs of frames.
    pub pairs: usize,
    /// The relative difference as given.
    pub error: f64,
    /// The same if the camera had not moved: what there is to tell by.
    pub error_without_motion: f64,
    /// The factor on depth, as given otherwise, that agrees best, and the difference then.
    pub best_factor: f64,
    /// See `best_factor`.
    pub best_factor_error: f64,
    /// Other readings, the best first.
    pub alternatives: Vec<Reading>,
}

/// Two frames of one place.
struct Pair {
    indices: [usize; 2],
    /// Pixel and depth in units, in the first frame.
    points: Vec<[f64; 3]>,
    depth: Vec<u16>,
}

impl Pair {
    fn points(camera: &Camera, depth: &[u16]) -> Vec<[f64; 3]> {
        let step = ((camera.pixels() as f64 / POINTS as f64).sqrt() as usize).max(1);
        let (w, h) = (camera.width as usize, camera.height as usize);
        let pixels = (step / 2..h).step_by(step).flat_map(|y| {
            (step / 2..w).step_by(step).map(move |x| (x, y, f64::from(depth[y * w + x])))
        });
        pixels.filter(|p| p.2 > 0.0).map(|(x, y, d)| [x as f64, y as f64, d]).collect()
    }

    /// Relative difference of depth at the same pixels.
    fn change(camera: &Camera, points: &[[f64; 3]], depth: &[u16]) -> f64 {
        let differences = points.iter().filter_map(|[x, y, d]| {
            let there = depth[*y as usize * camera.width as usize + *x as usize];
            (there > 0).then(|| (d / f64::from(there) - 1.0).abs())
        });
        median(differences.collect())
    }

    /// Returns depth between pixels \[units\], bilinear within a surface, else of the nearest pixel.
    fn depth_at(&self, width: usize, u: f64, v: f64) -> Option<f64> {
        let (x, y) = (u as usize, v as usize);
        let (a, b) = (u - x as f64, v - y as f64);
        let corner = |i: usize| f64::from(self.depth[(y + i / 2) * width + x + i % 2]);
        let corners = [0, 1, 2, 3].map(corner);
        let near = corners.iter().copied().fold(f64::INFINITY, f64::min);
        let far = corners.iter().copied().fold(0.0, f64::max);
        if near > 0.0 && far <= (1.0 + SURFACE) * near {
            let [p, q, r, s] = corners;
            return Some((p * (1.0 - a) + q * a) * (1.0 - b) + (r * (1.0 - a) + s * a) * b);
        }
        let nearest = corners[usize::from(a >= 0.5) + 2 * usize::from(b >= 0.5)];
        (nearest > 0.0).then_some(nearest)
    }

    /// Relative difference after moving the points by `motion`, with depth of `unit_m`.
    fn error(&self, camera: &Camera, motion: &Pose, unit_m: f64) -> f64 {
        let (w, h) = (f64::from(camera.width), f64::from(camera.height));
        let mut differences = Vec::with_capacity(self.points.len());
        for [x, y, d] in &self.points {
            let moved = motion.transform_point(camera.back_project(*x, *y, d * unit_m));
            let Some(at) = camera.project(moved) else { continue };
            if !(at.x >= 0.0 && at.y >= 0.0 && at.x < w - 1.0 && at.y < h - 1.0) {
                continue;
            }
            if let Some(there) = self.depth_at(camera.width as usize, at.x, at.y) {
                differences.push((moved.z / (there * unit_m) - 1.0).abs());
            }
        }
        if (differences.len() as f64) < COVERAGE * self.points.len() as f64 {
            return 1.0;
        }
        median(differences).min(1.0)
    }
}

/// Measures the agreement; `None` where no pair of frames with poses tells anything.
pub(super) fn measure(
    sequence: &mut dyn Sequence,
    anchors: &[usize],
    mut progress: impl FnMut(usize),
) -> Result<Option<Agreement>, SequenceError> {
    let info = sequence.info().clone();
    let mut pairs = Vec::new();
    let mut changes = Vec::new();
    for (done, &anchor) in anchors.iter().enumerate() {
        if let Some((pair, change)) = pair(sequence, &info, anchor)? {
            pairs.push(pair);
            changes.push(change);
        }
        progress(done + 1);
    }
    if pairs.is_empty() {
        return Ok(None);
    }
    let lexical = lexical_order(sequence);
    let error = |reading: PoseReading, unit_m: f64| -> f64 {
        let pose = |index: usize| {
            let index = match (reading, &lexical) {
                (PoseReading::LexicalOrder, Some(order)) => order[index],
                _ => index,
            };
            sequence.truth(index).map(|p| reading.apply(&p))
        };
        let one = |pair: &Pair| match pair.indices.map(pose) {
            [Some(a), Some(b)] => pair.error(&info.camera, &b.inverse().compose(&a), unit_m),
            _ => 1.0,
        };
        median(pairs.iter().map(one).collect())
    };

    let given = 1.0 / info.depth_unit_m;
    let mut scales = vec![given];
    scales.extend(USUAL_UNITS.into_iter().filter(|u| (u / given - 1.0).abs() > 0.02));
    let mut alternatives = Vec::new();
    for poses in PoseReading::ALL {
        if poses == PoseReading::LexicalOrder && lexical.is_none() {
            continue;
        }
        for &depth_scale in &scales {
            if poses != PoseReading::AsGiven || depth_scale != given {
                let error = error(poses, 1.0 / depth_scale);
                alternatives.push(Reading { poses, depth_scale, error });
            }
        }
    }
    // Stable, so that of two equally good ones the simpler stays in front.
    alternatives.sort_by(|a, b| a.error.total_cmp(&b.error));

    let at = |factor: f64| error(PoseReading::AsGiven, info.depth_unit_m * factor);
    let nearest = |factors: &mut dyn Iterator<Item = f64>| {
        factors.map(|f| (at(f), f)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((1.0, 1.0))
    };
    let coarse = nearest(&mut (-25..=25).map(|i| 1.1f64.powi(i)));
    let fine = nearest(&mut (-10..=10).map(|i| coarse.1 * 1.01f64.powi(i)));
    Ok(Some(Agreement {
        pairs: pairs.len(),
        error: at(1.0),
        error_without_motion: median(changes),
        best_factor: fine.1,
        best_factor_error: fine.0,
        alternatives,
    }))
}

/// The frame `anchor` with the first later one in which depth has changed enough.
fn pair(
    sequence: &mut dyn Sequence,
    info: &SequenceInfo,
    anchor: usize,
) -> Result<Option<(Pair, f64)>, SequenceError> {
    if sequence.truth(anchor).is_none() {
        return Ok(None);
    }
    let points = Pair::points(&info.camera, &sequence.frame(anchor)?.depth);
    if points.len() < 100 {
        return Ok(None);
    }
    let mut best: Option<(usize, Vec<u16>, f64)> = None;
    for offset in OFFSETS {
        let index = anchor + offset;
        if index >= info.frames {
            break;
        }
        if sequence.truth(index).is_none() {
            continue;
        }
        let depth = sequence.frame(index)?.depth;
        let change = Pair::change(&info.camera, &points, &depth);
        let enough = change >= CHANGE;
        if best.as_ref().is_none_or(|b| b.2 < change) {
            best = Some((index, depth, change));
        }
        if enough {
            break;
        }
    }
    let Some((index, depth, change)) = best.filter(|b| b.2 >= LEAST_CHANGE) else {
        return Ok(None);
    };
    Ok(Some((Pair { indices: [anchor, index], points, depth }, change)))
}

/// For each frame the one whose pose it has if the poses are in the lexical order of the frames'
/// numbers; `None` where that is the same order.
fn lexical_order(sequence: &dyn Sequence) -> Option<Vec<usize>> {
    let frames = sequence.info().frames;
    let mut sorted: Vec<usize> = (0..frames).collect();
    sorted.sort_by_key(|&i| sequence.number(i).to_string());
    if sorted.is_sorted() {
        return None;
    }
    let mut order = vec![0; frames];
    for (place, &frame) in sorted.iter().enumerate() {
        order[frame] = place;
    }
    Some(order)
}

impl Agreement {
    /// Returns whether an error is a clear improvement over the files as given, and not only as good as if
    /// the camera stood still (which any large depth comes near to).
    fn is_convincing(&self, error: f64) -> bool {
        self.error > GOOD && error < CONVINCING * self.error.min(self.error_without_motion)
    }

    /// The alternative that the evidence is for, if any.
    pub fn convincing(&self) -> Option<&Reading> {
        let best = self.alternatives.first()?;
        // A scale that is no known unit may explain it far better.
        let better =
            self.is_convincing(best.error) && self.best_factor_error > CONVINCING * best.error;
        // Among nearly equal ones the fewest changes.
        let simple = |r: &&Reading| r.error < 1.15 * best.error;
        let changes = |r: &&Reading| usize::from(r.poses != PoseReading::AsGiven);
        better.then(|| self.alternatives.iter().filter(simple).min_by_key(changes))?
    }

    pub(super) fn remark(&self, info: &SequenceInfo, add: &mut impl FnMut(Severity, String)) {
        let percent = |x: f64| format!("{:.1} %", 100.0 * x);
        let given = 1.0 / info.depth_unit_m;
        let still = percent(self.error_without_motion);
        if let Some(better) = self.convincing() {
            let (mut what, mut cures) = (Vec::new(), Vec::new());
            if better.depth_scale != given {
                let units = better.depth_scale;
                what.push(format!("with {units} units of depth per metre in place of {given}"));
                cures.push(format!("use --depth-scale {units}"));
            }
            if better.poses != PoseReading::AsGiven {
                what.push(format!("with the poses {}", better.poses.in_words(info.layout)));
                cures.push(better.poses.cure().to_string());
            }
            let text = format!(
                "depth moved by the true poses misses the measured depth by {}, but by {} {} ({still} \
                 if the camera stood still): {}",
                percent(self.error),
                percent(better.error),
                what.join(" and "),
                cures.join(", and ")
            );
            add(Severity::Warning, text);
            return;
        }
        let factor_off = (self.best_factor - 1.0).abs();
        if self.best_factor_error < CONVINCING * self.error
            && self.error > GOOD
            && factor_off > 0.03
        {
            let text = format!(
                "depth moved by the true poses misses the measured depth by {}, but by {} with depth \
                 times {:.2} (--depth-scale {:.0}): poses and depth have different scales",
                percent(self.error),
                percent(self.best_factor_error),
                self.best_factor,
                given / self.best_factor
            );
            add(Severity::Warning, text);
        } else if self.error > 0.6 * self.error_without_motion {
            let text = format!(
                "depth moved by the true poses misses the measured depth by {} ({still} if the \
                 camera stood still): poses, depth or camera are wrong, and none of the usual \
                 mistakes explains it",
                percent(self.error)
            );
            add(Severity::Warning, text);
        }
    }
}
