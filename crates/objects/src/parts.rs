//! Connected surfaces of a class, joined over gaps.
use crate::error::{ObjectsError, invalid};
use glam::DVec3;
use mte_slam_mesh::Mesh;

/// Samples per gap: the distance between samples is at most a quarter of it.
const SAMPLES_PER_GAP: f64 = 4.0;
/// Most samples of one class (28 bytes each).
const MOST_SAMPLES: u64 = 1 << 24;

/// Sets that are joined; the representative is the smallest member, so results have no order.
pub struct Sets(Vec<u32>);

impl Sets {
    fn new(n: usize) -> Sets {
        Sets((0..n as u32).collect())
    }

    /// Returns the smallest member of the set of `i`.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// Joins triangles of one class that share a vertex or are at most `gap_m` apart. `class` is per
/// triangle; those without one stay alone.
pub fn join(mesh: &Mesh, class: &[Option<u8>], gap_m: f64) -> Result<Sets, ObjectsError> {
    let mut sets = Sets::new(mesh.triangles.len());
    let mut corners: Vec<(u32, u8, u32)> = Vec::new();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(class) = class[t] {
            corners.extend(triangle.map(|v| (v, class, t as u32)));
        }
    }
    corners.sort_unstable();
    for pair in corners.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            sets.join(pair[0].2, pair[1].2);
        }
    }
    drop(corners);
    if gap_m > 0.0 {
        let mut by_class: Vec<Vec<u32>> = vec![Vec::new(); 256];
        for (t, class) in class.iter().enumerate() {
            if let Some(class) = class {
                by_class[usize::from(*class)].push(t as u32);
            }
        }
        // The class that a vertex was last sampled for; one that no class has to begin with.
        let mut sampled = vec![u16::MAX; mesh.positions.len()];
        for (class, triangles) in by_class.iter().enumerate() {
            let mut first = |v: u32| {
                let last = std::mem::replace(&mut sampled[v as usize], class as u16);
                last != class as u16
            };
            let samples = samples(mesh, triangles, &mut sets, gap_m, &mut first)
                .map_err(|found| too_many(class, found, gap_m))?;
            bridge(samples, &mut sets, gap_m);
        }
    }
    Ok(sets)
}

fn too_many(class: usize, found: u64, gap_m: f64) -> ObjectsError {
    invalid(
        format!("surface of class {class} for a gap of {gap_m} m"),
        format!("{found} samples"),
        format!("at most {MOST_SAMPLES}; choose a larger gap"),
    )
}

/// A point of a surface.
struct Sample {
    cell: [i32; 3],
    /// Smallest triangle of the part.
    part: u32,
    point: [f32; 3],
}

/// How often edges are divided.
fn divisions(corners: &[DVec3; 3], spacing_m: f64) -> u64 {
    let [a, b, c] = *corners;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    (longest / spacing_m).ceil().max(1.0) as u64
}

/// Samples of a class' surface, or how many there would be if that is too many. `first` says whether
/// a vertex is met for the first time.
fn samples(
    mesh: &Mesh,
    triangles: &[u32],
    sets: &mut Sets,
    gap_m: f64,
    first: &mut dyn FnMut(u32) -> bool,
) -> Result<Vec<Sample>, u64> {
    let spacing_m = gap_m / SAMPLES_PER_GAP;
    let mut count = 0u64;
    for &t in triangles {
        let n = divisions(&mesh.corners(t as usize), spacing_m);
        count = count.saturating_add((n + 1).saturating_mul(n + 2) / 2);
    }
    // Corners are shared by about six triangles and sampled once; the bound leaves them out.
    let bound = count.saturating_sub(2 * triangles.len() as u64);
    if bound > MOST_SAMPLES {
        return Err(bound);
    }
    let mut out = Vec::new();
    for &t in triangles {
        let corners = mesh.corners(t as usize);
        let [a, b, c] = corners;
        let part = sets.root(t);
        let n = divisions(&corners, spacing_m);
        for i in 0..=n {
            for j in 0..=n - i {
                let corner = match (i, j) {
                    (0, 0) => Some(0),
                    (i, 0) if i == n => Some(1),
                    (0, j) if j == n => Some(2),
                    _ => None,
                };
                if corner.is_some_and(|k: usize| !first(mesh.triangles[t as usize][k])) {
                    continue;
                }
                let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
                let p = a + u * (b - a) + v * (c - a);
                let cell = (p / gap_m).floor().to_array().map(|x| x as i32);
                out.push(Sample { cell, part, point: p.to_array().map(|x| x as f32) });
            }
        }
    }
    Ok(out)
}

/// Joins parts with samples at most a gap apart.
fn bridge(mut samples: Vec<Sample>, sets: &mut Sets, gap_m: f64) {
    samples.sort_by_key(|s| (s.cell, s.part));
    // Samples of one part in one cell: pairs of groups are few, and mostly of one set.
    let groups: Vec<&[Sample]> =
        samples.chunk_by(|a, b| (a.cell, a.part) == (b.cell, b.part)).collect();
    // Each pair of neighbouring cells once: those after the cell itself in the order.
    let mut ahead = Vec::new();
    for x in -1..=1i32 {
        for y in -1..=1i32 {
            for z in -1..=1i32 {
                if [x, y, z] > [0; 3] {
                    ahead.push([x, y, z]);
                }
            }
        }
    }
    let near = |a: &[Sample], b: &[Sample]| {
        let square = |p: &[f32; 3], q: &[f32; 3]| -> f64 {
            (0..3).map(|k| f64::from(p[k]) - f64::from(q[k])).map(|d| d * d).sum()
        };
        a.iter().any(|p| b.iter().any(|q| square(&p.point, &q.point) <= gap_m * gap_m))
    };
    for (i, group) in groups.iter().enumerate() {
        let cell = group[0].cell;
        let rest = groups[i + 1..].iter().take_while(|g| g[0].cell == cell);
        let in_ahead = ahead.iter().flat_map(|step| {
            let other = [0, 1, 2].map(|k| cell[k] + step[k]);
            let start = groups.partition_point(|g| g[0].cell < other);
            groups[start..].iter().take_while(move |g| g[0].cell == other)
        });
        for other in rest.chain(in_ahead) {
            let (a, b) = (group[0].part, other[0].part);
            if sets.root(a) != sets.root(b) && near(group, other) {
                sets.join(a, b);
            }
        }
    }
}
