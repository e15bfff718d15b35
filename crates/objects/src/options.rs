//! What counts as an object.
use crate::error::{ObjectsError, invalid};
use glam::DVec3;

/// Largest gap that may be bridged \[m\].
const MOST_GAP_M: f64 = 1.0;

/// What counts as an object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectOptions {
    /// Unit vector that points up in the world of the mesh. [`crate::cameras_up`] and
    /// [`crate::level_up`] find it where nothing else tells.
    pub up: DVec3,
    /// Surfaces of one class that are no farther apart than this are one object \[m\], 0 to 1; 0
    /// joins nothing but triangles with a common vertex. Distances are measured between samples a
    /// quarter of this apart, so a gap below 0.7 of it is always bridged, one above it never.
    pub gap_m: f64,
    /// Parts with less surface than this are dropped and counted \[m2\].
    pub min_area_m2: f64,
    /// Parts of fewer triangles than this are dropped and counted.
    pub min_triangles: usize,
    /// Names of classes that are the building's structure and not things in it, whatever their case.
    pub structure: Vec<String>,
}

impl Default for ObjectOptions {
    /// z up, gaps of 5 cm, at least 0.01 m2 and 12 triangles; wall, floor and ceiling are structure.
    fn default() -> Self {
        ObjectOptions {
            up: DVec3::Z,
            gap_m: 0.05,
            min_area_m2: 0.01,
            min_triangles: 12,
            structure: ["wall", "floor", "ceiling"].map(str::to_owned).to_vec(),
        }
    }
}

impl ObjectOptions {
    /// Returns whether a class of this name is structure.
    pub fn is_structure(&self, name: &str) -> bool {
        let name = name.trim().to_lowercase();
        self.structure.iter().any(|s| s.trim().to_lowercase() == name)
    }

    /// Checks ranges (that of `up` is checked where axes are made).
    pub(crate) fn check(&self) -> Result<(), ObjectsError> {
        // Below a millimetre the samples of a room would not fit into memory.
        if self.gap_m != 0.0 && !(0.001..=MOST_GAP_M).contains(&self.gap_m) {
            let expected = format!("0, or 0.001 to {MOST_GAP_M} m");
            return Err(invalid("gap", format!("{} m", self.gap_m), expected));
        }
        if !(self.min_area_m2 >= 0.0 && self.min_area_m2.is_finite()) {
            let found = format!("{} m2", self.min_area_m2);
            return Err(invalid("least area", found, "0 or more"));
        }
        Ok(())
    }
}
