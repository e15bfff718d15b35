//! What is measured of one part.
use crate::{axes::RoomAxes, bounds::RoomBox, visible::visible_share};
use mte_slam_mesh::Mesh;

/// Figures of one part of a mesh.
pub struct Measures {
    /// Surface \[m2\].
    pub area_m2: f64,
    /// Smallest box along the room's axes.
    pub bounds: RoomBox,
    /// Mean over the corners that have the class, weighted by area, 0 to 1.
    pub confidence: f64,
    /// Mean sRGB color, averaged as light; `None` where the mesh has none.
    pub color: Option<[u8; 3]>,
    /// See [`visible_share`].
    pub visible_share: f64,
}

/// Linear light of each sRGB byte.
pub struct Light([f64; 256]);

impl Light {
    pub fn new() -> Light {
        Light(std::array::from_fn(|i| {
            let s = i as f64 / 255.0;
            if s <= 0.04045 { s / 12.92 } else { libm::pow((s + 0.055) / 1.055, 2.4) }
        }))
    }

    /// Returns the byte whose light is nearest.
    fn byte(&self, light: f64) -> u8 {
        let above = self.0.partition_point(|l| *l < light).min(255);
        let below = above.saturating_sub(1);
        let nearer = light - self.0[below] < self.0[above] - light;
        (if nearer { below } else { above }) as u8
    }
}

/// Measures some triangles that make one part of class `class`. `confidence` is per vertex.
pub fn measure(
    mesh: &Mesh,
    triangles: &[u32],
    class: u8,
    confidence: &[f32],
    axes: &RoomAxes,
    light: &Light,
) -> Measures {
    let mut bounds = RoomBox::empty();
    let mut area_m2 = 0.0;
    let (mut sure, mut sure_weight) = (0.0, 0.0);
    let mut color = [0.0; 3];
    let mut in_room = Vec::with_capacity(triangles.len());
    for &t in triangles {
        let area = mesh.triangle_area(t as usize);
        let local = mesh.corners(t as usize).map(|p| axes.to_room(p));
        local.iter().for_each(|p| bounds.include(*p));
        in_room.push(local);
        area_m2 += area;
        for v in mesh.triangles[t as usize].map(|v| v as usize) {
            if mesh.classes[v] == class {
                sure += area * f64::from(confidence[v]);
                sure_weight += area;
            }
            if let Some(c) = mesh.colors.get(v) {
                for k in 0..3 {
                    color[k] += area * light.0[usize::from(c[k])];
                }
            }
        }
    }
    Measures {
        area_m2,
        visible_share: visible_share(&in_room, &bounds),
        bounds,
        confidence: if sure_weight > 0.0 { (sure / sure_weight).clamp(0.0, 1.0) } else { 0.0 },
        color: (area_m2 > 0.0 && !mesh.colors.is_empty())
            .then(|| color.map(|c| light.byte(c / (3.0 * area_m2)))),
    }
}

/// Returns for each vertex the share of the other corners of its triangles that have its class.
pub fn agreement(mesh: &Mesh) -> Vec<f32> {
    let mut counts = vec![(0u32, 0u32); mesh.positions.len()];
    for t in &mesh.triangles {
        for &v in t {
            let own = mesh.classes[v as usize];
            let same = t.iter().filter(|&&o| mesh.classes[o as usize] == own).count() as u32 - 1;
            let count = &mut counts[v as usize];
            *count = (count.0 + same, count.1 + 2);
        }
    }
    counts.iter().map(|&(same, all)| if all > 0 { same as f32 / all as f32 } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_comes_back() {
        let light = Light::new();
        for i in 0..=255u8 {
            assert_eq!(light.byte(light.0[usize::from(i)]), i);
        }
        assert_eq!((light.byte(-1.0), light.byte(2.0)), (0, 255));
    }

    #[test]
    fn a_vertex_agrees_with_the_corners_around_it() {
        // Two triangles with a common edge; one vertex has another class.
        let mesh = Mesh {
            positions: vec![[0.0; 3]; 4],
            classes: vec![1, 1, 1, 2],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
            ..Mesh::default()
        };
        assert_eq!(agreement(&mesh), [1.0, 0.75, 0.75, 0.0]);
    }
}
