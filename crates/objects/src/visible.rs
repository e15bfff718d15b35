//! How much of a thing was seen.
use crate::bounds::RoomBox;
use glam::DVec3;

/// Cells of a picture along the longest edge of the box.
const CELLS: f64 = 64.0;

/// Returns the share of a thing's outside that has a surface: the thing is looked at from the six
/// sides of its box, in pictures without perspective. In each, its silhouette is what any triangle
/// covers, and what was seen is what a triangle covers that faces that side; the result is seen area
/// over silhouette, summed over the six pictures. Triangles are given by their corners in room
/// coordinates.
///
/// A closed surface gives 1, a picture on a wall, seen from the front, about one half.
pub fn visible_share(triangles: &[[DVec3; 3]], bounds: &RoomBox) -> f64 {
    let extent = bounds.extent();
    let cell = extent.max_element() / CELLS;
    if !(cell > 0.0 && cell.is_finite()) {
        return 0.0;
    }
    let (mut seen, mut silhouette) = (0u64, 0u64);
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let count = |k: usize| ((extent[k] / cell).ceil() as usize).clamp(1, CELLS as usize);
        let (width, height) = (count(u), count(v));
        // Cells have their own size per direction, so that the picture ends where the box does.
        let size = |k: usize, n: usize| (extent[k] / n as f64).max(f64::MIN_POSITIVE);
        let (du, dv) = (size(u, width), size(v, height));
        // Bit 0: covered by a triangle that faces the positive side, bit 1: the negative one.
        let mut picture = vec![0u8; width * height];
        for corners in triangles {
            let [a, b, c] = corners
                .map(|p| ((p[u] - bounds.min[u]) / du - 0.5, (p[v] - bounds.min[v]) / dv - 0.5));
            let edge = |p: (f64, f64), q: (f64, f64), r: (f64, f64)| {
                (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0)
            };
            let twice = edge(a, b, c);
            // Edge on: it covers nothing.
            if twice.abs() < 1e-9 {
                continue;
            }
            let side = if twice > 0.0 { 1 } else { 2 };
            let span = |x: f64, y: f64, z: f64, n: usize| {
                let low = x.min(y).min(z).ceil().max(0.0);
                let high = x.max(y).max(z).floor().min(n as f64 - 1.0);
                if low > high { 0..0 } else { low as usize..high as usize + 1 }
            };
            for y in span(a.1, b.1, c.1, height) {
                for x in span(a.0, b.0, c.0, width) {
                    let p = (x as f64, y as f64);
                    let inside = [edge(a, b, p), edge(b, c, p), edge(c, a, p)];
                    if inside.iter().all(|e| e * twice >= 0.0) {
                        picture[y * width + x] |= side;
                    }
                }
            }
        }
        // Weighted by the area of a cell, in units that stay whole: cells differ by picture.
        let weight = (du * dv / (cell * cell) * 1e6) as u64;
        for bits in picture.into_iter().filter(|bits| *bits != 0) {
            silhouette += 2 * weight;
            seen += u64::from(bits.count_ones()) * weight;
        }
    }
    if silhouette == 0 { 0.0 } else { seen as f64 / silhouette as f64 }
}
