//! Semantic classes: raw label ids of a data set, their names and colours, and the compact
//! indices 0..C the map works with.
use alloc::{collections::BTreeMap, string::String, vec::Vec};
use serde::{Deserialize, Serialize};

/// Compact index of a pixel without a label.
pub const UNLABELLED: u8 = 255;

/// One class.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    /// The id in the data set's label images.
    pub raw_id: u16,
    /// Human-readable name.
    pub name: String,
    /// Display colour, sRGB.
    pub color: [u8; 3],
}

/// The classes of a run, in the order of their compact index. At most 255.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClassTable {
    /// The classes; the compact index is the position.
    pub classes: Vec<Class>,
}

impl ClassTable {
    /// Returns the number of classes.
    pub fn len(&self) -> usize {
        self.classes.len()
    }

    /// Returns whether there are no classes (semantics are then off).
    pub fn is_empty(&self) -> bool {
        self.classes.is_empty()
    }

    /// Raw id -> compact index.
    pub fn index_of_raw(&self) -> BTreeMap<u16, u8> {
        self.classes.iter().enumerate().map(|(i, c)| (c.raw_id, i as u8)).collect()
    }
}

/// Returns a colour for a class without one: hues a golden ratio apart, in three brightnesses.
pub fn class_color(id: u16) -> [u8; 3] {
    let hue = f64::from(id) * 0.618_033_988_749_895 % 1.0 * 6.0;
    let value = [240.0, 200.0, 160.0][usize::from(id % 3)];
    let channel = |shift: f64| {
        let k = (shift + hue) % 6.0;
        let fall = k.min(4.0 - k).clamp(0.0, 1.0);
        (value * (1.0 - 0.7 * fall)) as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::collections::BTreeSet;

    #[test]
    fn colors_differ() {
        let colors: BTreeSet<[u8; 3]> = (0..255).map(class_color).collect();
        assert!(colors.len() > 250, "{}", colors.len());
    }
}
