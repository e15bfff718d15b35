//! Nearest neighbours: a bounding volume hierarchy over points or triangles.
use alloc::{vec, vec::Vec};
use glam::DVec3;
use mte_slam_mesh::to_dvec3;

/// Shapes in a leaf, at most: few, but a fine mesh has 20 million, and a node takes 32 bytes.
const LEAF: usize = 8;

/// What the hierarchy can hold.
pub(crate) trait Shape: Copy + Send + Sync {
    /// Returns the smallest and largest corner of the enclosing box.
    fn bounds(&self) -> ([f32; 3], [f32; 3]);
    /// Returns the square of the exact distance to a point.
    fn distance_squared(&self, p: DVec3) -> f64;
}

impl Shape for [f32; 3] {
    fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        (*self, *self)
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        to_dvec3(*self).distance_squared(p)
    }
}

/// Three corners.
impl Shape for [[f32; 3]; 3] {
    fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let [a, b, c] = self;
        let each = |f: fn(f32, f32) -> f32| core::array::from_fn(|i| f(f(a[i], b[i]), c[i]));
        (each(f32::min), each(f32::max))
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        let [a, b, c] = self.map(to_dvec3);
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let normal = ab.cross(ac);
        let square = normal.length_squared();
        let v = ap.cross(ac).dot(normal);
        let w = ab.cross(ap).dot(normal);
        // Above the triangle; never so for a degenerate one, which is just its sides.
        if square > 0.0 && v >= 0.0 && w >= 0.0 && v + w <= square {
            let height = ap.dot(normal);
            return height * height / square;
        }
        let side = |from: DVec3, to: DVec3| {
            let (d, q) = (to - from, p - from);
            let length = d.length_squared();
            let t = if length > 0.0 { (q.dot(d) / length).clamp(0.0, 1.0) } else { 0.0 };
            (q - d * t).length_squared()
        };
        side(a, b).min(side(b, c)).min(side(c, a))
    }
}

struct Node {
    low: [f32; 3],
    high: [f32; 3],
    /// A leaf's first shape; an inner node's second child (the first one follows the node).
    start: u32,
    /// Shapes of a leaf; 0 for an inner node.
    count: u32,
}

impl Node {
    fn distance_squared(&self, p: DVec3) -> f64 {
        let (low, high) = (to_dvec3(self.low), to_dvec3(self.high));
        (p - p.clamp(low, high)).length_squared()
    }
}

/// Bounding volume hierarchy, split at the median of the longest axis.
pub(crate) struct NearestBvh<S> {
    nodes: Vec<Node>,
    /// Shapes in the order of the leaves, and each one's index in the list given.
    shapes: Vec<S>,
    indices: Vec<u32>,
}

impl<S: Shape> NearestBvh<S> {
    /// Builds over shapes with finite coordinates (others are left out).
    pub(crate) fn new(shapes: &[S]) -> NearestBvh<S> {
        NearestBvh::of(shapes.to_vec())
    }

    /// As [`NearestBvh::new`], without a second copy of the shapes.
    pub(crate) fn of(mut shapes: Vec<S>) -> NearestBvh<S> {
        let centre = |s: &S| {
            let (low, high) = s.bounds();
            core::array::from_fn::<f32, 3, _>(|a| low[a] * 0.5 + high[a] * 0.5)
        };
        let mut items: Vec<([f32; 3], u32)> = shapes
            .iter()
            .enumerate()
            .map(|(i, s)| (centre(s), i as u32))
            .filter(|(c, _)| c.iter().all(|x| x.is_finite()))
            .collect();
        let mut nodes = Vec::with_capacity(node_count(items.len()));
        if !items.is_empty() {
            let all = items.len();
            build(&shapes, &mut items, 0..all, &mut nodes);
        }
        let indices: Vec<u32> = items.iter().map(|(_, i)| *i).collect();
        drop(items);
        // Memory: a copy of the shapes would be the largest thing here.
        let in_place = indices.len() == shapes.len();
        if in_place {
            permute(&mut shapes, &indices);
        } else {
            shapes = indices.iter().map(|&i| shapes[i as usize]).collect();
        }
        NearestBvh { nodes, shapes, indices }
    }

    /// Returns the shapes, neighbours next to each other.
    pub(crate) fn shapes(&self) -> &[S] {
        &self.shapes
    }

    /// Returns the nearest shape closer than `limit`: its index in the list given, and the square of its
    /// distance. Of equally near ones, any, but always the same.
    pub(crate) fn nearest(&self, p: DVec3, limit: f64) -> Option<(u32, f64)> {
        let mut best = (u32::MAX, limit * limit);
        // Depth is at most log2 of 2^32 shapes, with one waiting sibling a level.
        let mut stack = [(0u32, 0f64); 64];
        let mut len = usize::from(!self.nodes.is_empty());
        while len > 0 {
            len -= 1;
            let (at, distance) = stack[len];
            if distance >= best.1 {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for i in node.start as usize..(node.start + node.count) as usize {
                    let d = self.shapes[i].distance_squared(p);
                    if d < best.1 {
                        best = (self.indices[i], d);
                    }
                }
                continue;
            }
            let first = (at + 1, self.nodes[at as usize + 1].distance_squared(p));
            let second = (node.start, self.nodes[node.start as usize].distance_squared(p));
            let (near, far) = if first.1 <= second.1 { (first, second) } else { (second, first) };
            (stack[len], stack[len + 1]) = (far, near);
            len += 2;
        }
        (best.0 != u32::MAX).then_some(best)
    }
}

/// Nodes that [`build`] makes of this many shapes. Halves differ by one shape at most, so each level
/// has nodes of two sizes only.
fn node_count(shapes: usize) -> usize {
    if shapes == 0 {
        return 0;
    }
    let mut nodes = 0;
    // Nodes of `size` and of `size + 1` shapes on a level.
    let (mut size, mut even, mut more) = (shapes, 1, 0);
    loop {
        nodes += even + more;
        even = if size > LEAF { even } else { 0 };
        more = if size + 1 > LEAF { more } else { 0 };
        if even + more == 0 {
            return nodes;
        }
        (even, more) = match size % 2 {
            0 => (2 * even + more, more),
            _ => (even, even + 2 * more),
        };
        size /= 2;
    }
}

/// Puts `shapes[order[i]]` at i, for all i at once.
fn permute<S: Copy>(shapes: &mut [S], order: &[u32]) {
    let mut done = vec![false; order.len()];
    for start in 0..order.len() {
        if done[start] {
            continue;
        }
        let (first, mut at) = (shapes[start], start);
        loop {
            done[at] = true;
            let next = order[at] as usize;
            if next == start {
                shapes[at] = first;
                break;
            }
            shapes[at] = shapes[next];
            at = next;
        }
    }
}

fn build<S: Shape>(
    shapes: &[S],
    items: &mut [([f32; 3], u32)],
    range: core::ops::Range<usize>,
    nodes: &mut Vec<Node>,
) {
    let part = &mut items[range.clone()];
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let (mut centre_low, mut centre_high) = (low, high);
    for (c, i) in part.iter() {
        let (l, h) = shapes[*i as usize].bounds();
        for a in 0..3 {
            (low[a], high[a]) = (low[a].min(l[a]), high[a].max(h[a]));
            (centre_low[a], centre_high[a]) = (centre_low[a].min(c[a]), centre_high[a].max(c[a]));
        }
    }
    let (start, count) = (range.start as u32, range.len() as u32);
    let at = nodes.len();
    nodes.push(Node { low, high, start, count });
    if range.len() <= LEAF {
        return;
    }
    let size = |a: &usize| centre_high[*a] - centre_low[*a];
    let axis = (0..3).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let half = range.len() / 2;
    // The index breaks ties, so that the tree is the same every time.
    part.select_nth_unstable_by(half, |(a, i), (b, j)| a[axis].total_cmp(&b[axis]).then(i.cmp(j)));
    let middle = range.start + half;
    build(shapes, items, range.start..middle, nodes);
    nodes[at].start = nodes.len() as u32;
    nodes[at].count = 0;
    build(shapes, items, middle..range.end, nodes);
}

/// Returns the triangles of a mesh as shapes.
pub(crate) fn triangles(mesh: &mte_slam_mesh::Mesh) -> Vec<[[f32; 3]; 3]> {
    let mut out = vec![];
    out.extend(mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_types::maths::Random;

    fn point(rng: &mut Random) -> [f32; 3] {
        core::array::from_fn(|_| rng.uniform() as f32)
    }

    #[test]
    fn nearest_agrees_with_trying_all() {
        let mut rng = Random::new(5, 0);
        let points: Vec<[f32; 3]> = (0..999).map(|_| point(&mut rng)).collect();
        let mut triangles: Vec<[[f32; 3]; 3]> = (0..500)
            .map(|_| {
                let a = point(&mut rng);
                let mut near = || core::array::from_fn(|i| a[i] + 0.1 * rng.uniform() as f32);
                [a, near(), near()]
            })
            .collect();
        triangles[7] = [points[0]; 3]; // degenerate ones
        triangles[8][2] = triangles[8][1];
        triangles[9][0][1] = f32::NAN;
        let (by_point, by_triangle) = (NearestBvh::new(&points), NearestBvh::new(&triangles));
        for _ in 0..300 {
            let p = to_dvec3(point(&mut rng)) * 1.5;
            let all = points.iter().map(|s| s.distance_squared(p)).fold(f64::MAX, f64::min);
            let (i, d) = by_point.nearest(p, f64::MAX).unwrap();
            assert_eq!((all, points[i as usize].distance_squared(p)), (d, d));
            let all = triangles.iter().map(|s| s.distance_squared(p));
            let all = all.filter(|d| d.is_finite()).fold(f64::MAX, f64::min);
            assert_eq!(by_triangle.nearest(p, 10.0).unwrap().1, all);
            assert!(by_triangle.nearest(p, all.sqrt() * 0.999).is_none());
        }
        assert!(NearestBvh::<[f32; 3]>::new(&[]).nearest(DVec3::ZERO, 1.0).is_none());
    }

    #[test]
    fn as_many_nodes_as_foretold_and_shapes_in_their_order() {
        let mut rng = Random::new(7, 0);
        for n in (0..300).chain([1000, 4097]) {
            let points: Vec<[f32; 3]> = (0..n).map(|_| point(&mut rng)).collect();
            let bvh = NearestBvh::new(&points);
            assert_eq!(bvh.nodes.len(), node_count(n), "{n} shapes");
            for (shape, i) in bvh.shapes.iter().zip(&bvh.indices) {
                assert_eq!(*shape, points[*i as usize]);
            }
            let mut all = bvh.indices.clone();
            all.sort_unstable();
            assert!(all.iter().enumerate().all(|(k, i)| k == *i as usize) && all.len() == n);
        }
    }

    #[test]
    fn triangle_distance_is_that_of_its_nearest_point() {
        let mut rng = Random::new(6, 0);
        for case in 0..300 {
            let mut t: [[f32; 3]; 3] = core::array::from_fn(|_| point(&mut rng));
            // Needles and points, too.
            match case % 10 {
                8 => t[2] = core::array::from_fn(|a| 0.3 * t[0][a] + 0.7 * t[1][a] + 1e-4),
                9 => t[1] = t[0],
                _ => {}
            }
            let p = to_dvec3(point(&mut rng)) * 3.0 - 1.0;
            let [a, b, c] = t.map(to_dvec3);
            // No point of a fine grid on the triangle is nearer, and one is hardly farther.
            let n = 60;
            let mut least = f64::MAX;
            for i in 0..=n {
                for j in 0..=n - i {
                    let (v, w) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                    least = least.min((a + (b - a) * v + (c - a) * w - p).length());
                }
            }
            let cell = ((b - a).length() + (c - a).length()) / f64::from(n);
            let found = num_traits::Float::sqrt(t.distance_squared(p));
            assert!(found <= least + 1e-9 && least <= found + cell, "case {case}: {found} {least}");
        }
    }

    #[test]
    fn triangle_distance_by_region() {
        let t = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let d = |x, y, z| t.distance_squared(DVec3::new(x, y, z));
        assert_eq!(d(0.2, 0.3, -2.0), 4.0); // above the inside
        assert_eq!(d(0.5, -3.0, 0.0), 9.0); // a side
        assert_eq!(d(-3.0, -4.0, 0.0), 25.0); // a corner
        assert!((d(1.0, 1.0, 0.0) - 0.5).abs() < 1e-12); // the long side
        let line = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        assert_eq!(line.distance_squared(DVec3::new(2.0, 2.0, 0.0)), 4.0);
    }
}
