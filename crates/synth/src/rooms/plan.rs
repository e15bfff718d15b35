//! Where things may go in a room that is drawn at random: on the floor and on the walls, without
//! running into each other.
use crate::builder::Builder;
use alloc::vec::Vec;

/// Tries before a piece is left out.
const TRIES: usize = 10;

/// Returns whether something of this probability happens.
pub fn chance(b: &mut Builder, probability: f32) -> bool {
    b.rng.range(0.0, 1.0) < probability
}

/// Returns a color with its brightness scaled by a factor in [low, high).
pub fn shade(b: &mut Builder, color: [u8; 3], low: f32, high: f32) -> [u8; 3] {
    let k = b.rng.range(low, high);
    color.map(|c| (f32::from(c) * k) as u8)
}

/// A wall seen from inside: x along it to the right, y = 0 on it, the room at negative y.
#[derive(Clone, Copy)]
pub struct Wall {
    index: usize,
    /// Middle of its foot \[m\].
    pub origin: [f32; 3],
    /// Turn about z \[degrees\].
    pub degrees: f32,
    /// Half its length \[m\].
    pub half: f32,
}

#[derive(Clone, Copy)]
struct Rect {
    low: [f32; 2],
    high: [f32; 2],
}

impl Rect {
    fn meets(&self, other: &Rect) -> bool {
        (0..2).all(|i| self.low[i] < other.high[i] && other.low[i] < self.high[i])
    }
}

/// What is taken already.
pub struct Plan {
    half: [f32; 2],
    /// Height of the ceiling \[m\].
    pub height: f32,
    floor: Vec<Rect>,
    walls: [Vec<Rect>; 4],
}

impl Plan {
    /// Starts with an empty room of this half size \[m\].
    pub fn new(half: [f32; 2], height: f32) -> Plan {
        Plan { half, height, floor: Vec::new(), walls: Default::default() }
    }

    /// Returns a wall by number; north, west, south, east, and again.
    pub fn wall(&self, index: usize) -> Wall {
        let [x, y] = self.half;
        let index = index % 4;
        let (origin, degrees, half) = match index {
            0 => ([0.0, y, 0.0], 0.0, x),
            1 => ([-x, 0.0, 0.0], 90.0, y),
            2 => ([0.0, -y, 0.0], 180.0, x),
            _ => ([x, 0.0, 0.0], -90.0, y),
        };
        Wall { index, origin, degrees, half }
    }

    /// Marks a part of a wall as taken, from x to x and from z to z.
    pub fn cover(&mut self, wall: Wall, x: [f32; 2], z: [f32; 2]) {
        self.walls[wall.index].push(Rect { low: [x[0], z[0]], high: [x[1], z[1]] });
    }

    /// Finds and takes a free part of a wall, `width` wide; returns its middle. Following solids
    /// are relative to the wall.
    pub fn hang(&mut self, b: &mut Builder, wall: Wall, width: f32, z: [f32; 2]) -> Option<f32> {
        b.place(wall.origin, wall.degrees);
        let reach = wall.half - 0.5 * width - 0.05;
        if reach <= 0.0 {
            return None;
        }
        for _ in 0..TRIES {
            let x = b.rng.range(-reach, reach);
            let rect = Rect { low: [x - 0.5 * width, z[0]], high: [x + 0.5 * width, z[1]] };
            if self.walls[wall.index].iter().all(|r| !r.meets(&rect)) {
                self.walls[wall.index].push(rect);
                return Some(x);
            }
        }
        None
    }

    /// Finds and takes a free place at a wall for a piece of this width, depth and height;
    /// returns where along the wall. Following solids are relative to a point `off` before it.
    pub fn stand(
        &mut self,
        b: &mut Builder,
        wall: Wall,
        [width, depth, height]: [f32; 3],
        off: f32,
    ) -> Option<f32> {
        let reach = wall.half - 0.5 * width - 0.02;
        if reach <= 0.0 {
            return None;
        }
        for _ in 0..TRIES {
            b.place(wall.origin, wall.degrees);
            let x = b.rng.range(-reach, reach);
            let front = Rect { low: [x - 0.5 * width, 0.0], high: [x + 0.5 * width, height] };
            let (p, q) =
                (b.world([x - 0.5 * width, -depth, 0.0]), b.world([x + 0.5 * width, 0.0, 0.0]));
            let rect =
                Rect { low: [p.x.min(q.x), p.y.min(q.y)], high: [p.x.max(q.x), p.y.max(q.y)] };
            let free = self.walls[wall.index].iter().all(|r| !r.meets(&front))
                && self.floor.iter().all(|r| !r.meets(&rect));
            if free {
                self.walls[wall.index].push(front);
                self.floor.push(rect);
                let at = b.world([x, -off, 0.0]);
                b.place(at.to_array(), wall.degrees);
                return Some(x);
            }
        }
        None
    }

    /// Finds and takes a free place away from the walls; returns its middle.
    pub fn middle(&mut self, b: &mut Builder, [w, d]: [f32; 2], across: bool) -> Option<[f32; 2]> {
        let half = if across { [0.5 * d, 0.5 * w] } else { [0.5 * w, 0.5 * d] };
        let reach = [0, 1].map(|i| 0.75 * (self.half[i] - half[i] - 0.1));
        if reach[0] <= 0.0 || reach[1] <= 0.0 {
            return None;
        }
        for _ in 0..TRIES {
            let at = [b.rng.range(-reach[0], reach[0]), b.rng.range(-reach[1], reach[1])];
            let rect = Rect {
                low: [at[0] - half[0], at[1] - half[1]],
                high: [at[0] + half[0], at[1] + half[1]],
            };
            if self.floor.iter().all(|r| !r.meets(&rect)) {
                self.floor.push(rect);
                return Some(at);
            }
        }
        None
    }
}
