//! Nearest-hit and any-hit ray queries over the primitives.
use super::shape::Primitive;
use alloc::{vec, vec::Vec};
use glam::Vec3;

/// Bounds the stack of a query: one postponed sibling for each level.
const MAX_DEPTH: usize = 40;

struct Node {
    min: Vec3,
    max: Vec3,
    /// First entry of `order` in a leaf; the left child otherwise (the right one follows it).
    first: u32,
    /// Number of primitives of a leaf; 0 for an inner node.
    count: u32,
}

/// A bounding volume hierarchy built by the surface-area rule.
pub struct PrimitiveBvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// A hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Index of the primitive.
    pub primitive: u32,
    /// Its face.
    pub face: u8,
}

fn area(min: Vec3, max: Vec3) -> f32 {
    let e = max - min;
    e.x * e.y + e.y * e.z + e.z * e.x
}

impl PrimitiveBvh {
    /// Builds over all primitives.
    pub fn new(primitives: &[Primitive]) -> PrimitiveBvh {
        let boxes: Vec<(Vec3, Vec3)> = primitives.iter().map(Primitive::bounds).collect();
        let mut bvh =
            PrimitiveBvh { nodes: Vec::new(), order: (0..primitives.len() as u32).collect() };
        let empty = Node { min: Vec3::ZERO, max: Vec3::ZERO, first: 0, count: 0 };
        bvh.nodes.push(empty);
        let mut work = vec![(0usize, 0usize, primitives.len(), 0usize)];
        while let Some((node, start, end, depth)) = work.pop() {
            let around = |ids: &[u32]| {
                ids.iter().fold((Vec3::MAX, Vec3::MIN), |(lo, hi), &i| {
                    (lo.min(boxes[i as usize].0), hi.max(boxes[i as usize].1))
                })
            };
            let (min, max) = around(&bvh.order[start..end]);
            let n = end - start;
            let mut best = (area(min, max) * (n as f32 - 1.0), None);
            for axis in 0..3 {
                if n < 3 || depth >= MAX_DEPTH {
                    break;
                }
                let ids = &mut bvh.order[start..end];
                ids.sort_by(|&i, &j| {
                    let key = |k: u32| boxes[k as usize].0[axis] + boxes[k as usize].1[axis];
                    key(i).total_cmp(&key(j)).then(i.cmp(&j))
                });
                for split in 1..n {
                    let (l, r) = (around(&ids[..split]), around(&ids[split..]));
                    let cost = area(l.0, l.1) * split as f32 + area(r.0, r.1) * (n - split) as f32;
                    if cost < best.0 {
                        best = (cost, Some((axis, split)));
                    }
                }
            }
            if let (_, Some((axis, split))) = best {
                bvh.order[start..end].sort_by(|&i, &j| {
                    let key = |k: u32| boxes[k as usize].0[axis] + boxes[k as usize].1[axis];
                    key(i).total_cmp(&key(j)).then(i.cmp(&j))
                });
                let left = bvh.nodes.len();
                bvh.nodes[node] = Node { min, max, first: left as u32, count: 0 };
                for _ in 0..2 {
                    bvh.nodes.push(Node { min, max, first: 0, count: 0 });
                }
                work.push((left, start, start + split, depth + 1));
                work.push((left + 1, start + split, end, depth + 1));
            } else {
                bvh.nodes[node] = Node { min, max, first: start as u32, count: n as u32 };
            }
        }
        bvh
    }

    /// Visits the leaves a ray touches before `limit`, nearer children first; `visit` gets a
    /// primitive and the current limit and returns the new one, or `None` to stop.
    fn walk(&self, o: Vec3, d: Vec3, limit: f32, mut visit: impl FnMut(u32, f32) -> Option<f32>) {
        let inv = d.recip();
        let enter = |node: &Node, limit: f32| {
            let (a, b) = ((node.min - o) * inv, (node.max - o) * inv);
            let (near, far) = (a.min(b), a.max(b));
            let t0 = near.x.max(near.y).max(near.z).max(0.0);
            let t1 = far.x.min(far.y).min(far.z).min(limit);
            (t0 <= t1).then_some(t0)
        };
        let mut limit = limit;
        let mut stack = [(0u32, 0f32); MAX_DEPTH + 2];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (id, t0) = stack[top];
            if t0 > limit {
                continue;
            }
            let node = &self.nodes[id as usize];
            if node.count > 0 {
                for &p in &self.order[node.first as usize..(node.first + node.count) as usize] {
                    match visit(p, limit) {
                        Some(l) => limit = l,
                        None => return,
                    }
                }
                continue;
            }
            let (l, r) = (node.first, node.first + 1);
            let hit_l = enter(&self.nodes[l as usize], limit);
            let hit_r = enter(&self.nodes[r as usize], limit);
            match (hit_l, hit_r) {
                (Some(a), Some(b)) => {
                    let ((n, tn), (f, tf)) =
                        if a <= b { ((l, a), (r, b)) } else { ((r, b), (l, a)) };
                    stack[top] = (f, tf);
                    stack[top + 1] = (n, tn);
                    top += 2;
                }
                (Some(a), None) => {
                    stack[top] = (l, a);
                    top += 1;
                }
                (None, Some(b)) => {
                    stack[top] = (r, b);
                    top += 1;
                }
                (None, None) => {}
            }
        }
    }

    /// Returns the nearest hit before `limit`.
    pub fn nearest(&self, primitives: &[Primitive], o: Vec3, d: Vec3, limit: f32) -> Option<Hit> {
        let mut best = None;
        self.walk(o, d, limit, |p, limit| {
            if let Some((t, face)) = primitives[p as usize].intersect(o, d, 1e-4, limit) {
                best = Some(Hit { t, primitive: p, face });
                return Some(t);
            }
            Some(limit)
        });
        best
    }

    /// Returns whether anything is hit before `limit`; rays start a little off their surface.
    pub fn blocked(&self, primitives: &[Primitive], o: Vec3, d: Vec3, limit: f32) -> bool {
        let mut found = false;
        self.walk(o, d, limit, |p, limit| {
            let solid = &primitives[p as usize];
            // A start inside another solid counts: the surface there cannot be seen or lit.
            if solid.intersect(o, d, 0.0, limit).is_some() || solid.contains(o) {
                found = true;
                return None;
            }
            Some(limit)
        });
        found
    }
}
