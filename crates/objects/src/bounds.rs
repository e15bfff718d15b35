//! Boxes along a room's axes.
use glam::DVec3;

/// A box along a room's axes, in room coordinates \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomBox {
    /// Smallest x, y and height.
    pub min: DVec3,
    /// Largest x, y and height.
    pub max: DVec3,
}

impl RoomBox {
    /// Returns the box that holds nothing, to be grown by [`RoomBox::include`].
    pub fn empty() -> RoomBox {
        RoomBox { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY }
    }

    /// Grows the box to hold a point.
    pub fn include(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Returns the middle.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Returns the lengths of the edges along x, y and up \[m\].
    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// Returns the intersection's volume over the union's, 0 to 1. Both boxes must be of the same
    /// axes. Edges shorter than 1 cm count as 1 cm around their middle, so that flat things have a
    /// volume.
    pub fn iou(&self, other: &RoomBox) -> f64 {
        let (a, b) = (self.thickened(), other.thickened());
        let common = (a.max.min(b.max) - a.min.max(b.min)).max(DVec3::ZERO).element_product();
        let union = a.extent().element_product() + b.extent().element_product() - common;
        if union > 0.0 { common / union } else { 0.0 }
    }

    fn thickened(&self) -> RoomBox {
        const HALF_M: f64 = 0.005;
        let (center, half) = (self.center(), (0.5 * self.extent()).max(DVec3::splat(HALF_M)));
        RoomBox { min: center - half, max: center + half }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlap_of_boxes_worked_out_by_hand() {
        let cube =
            |x: f64| RoomBox { min: DVec3::new(x, 0.0, 0.0), max: DVec3::new(x + 1.0, 1.0, 1.0) };
        assert_eq!(cube(0.0).iou(&cube(0.0)), 1.0);
        assert!((cube(0.0).iou(&cube(0.5)) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(cube(0.0).iou(&cube(2.0)), 0.0);
        let flat = RoomBox { min: DVec3::ZERO, max: DVec3::new(1.0, 1.0, 0.0) };
        assert_eq!(flat.iou(&flat), 1.0);
        assert_eq!(RoomBox::empty().iou(&cube(0.0)), 0.0);
    }
}
