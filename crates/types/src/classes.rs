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

    /// Returns the 40 classes of NYU Depth v2, with the ids and colors that they have in ScanNet's label
    /// images; 0 is no class there.
    pub fn nyu40() -> ClassTable {
        let class = |(i, (name, color)): (usize, &(&str, [u8; 3]))| Class {
            raw_id: i as u16 + 1,
            name: (*name).into(),
            color: *color,
        };
        ClassTable { classes: NYU40.iter().enumerate().map(class).collect() }
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

/// Names and colours of the ids 1 to 40.
#[rustfmt::skip]
const NYU40: [(&str, [u8; 3]); 40] = [
    ("wall", [174, 199, 232]), ("floor", [152, 223, 138]), ("cabinet", [31, 119, 180]),
    ("bed", [255, 187, 120]), ("chair", [188, 189, 34]), ("sofa", [140, 86, 75]),
    ("table", [255, 152, 150]), ("door", [214, 39, 40]), ("window", [197, 176, 213]),
    ("bookshelf", [148, 103, 189]), ("picture", [196, 156, 148]), ("counter", [23, 190, 207]),
    ("blinds", [178, 76, 76]), ("desk", [247, 182, 210]), ("shelves", [66, 188, 102]),
    ("curtain", [219, 219, 141]), ("dresser", [140, 57, 197]), ("pillow", [202, 185, 52]),
    ("mirror", [51, 176, 203]), ("floor mat", [200, 54, 131]), ("clothes", [92, 193, 61]),
    ("ceiling", [78, 71, 183]), ("books", [172, 114, 82]), ("refrigerator", [255, 127, 14]),
    ("television", [91, 163, 138]), ("paper", [153, 98, 156]), ("towel", [140, 153, 101]),
    ("shower curtain", [158, 218, 229]), ("box", [100, 125, 154]), ("whiteboard", [178, 127, 135]),
    ("person", [120, 185, 128]), ("nightstand", [146, 111, 194]), ("toilet", [44, 160, 44]),
    ("sink", [112, 128, 144]), ("lamp", [96, 207, 209]), ("bathtub", [227, 119, 194]),
    ("bag", [213, 92, 176]), ("otherstructure", [94, 106, 211]), ("otherfurniture", [82, 84, 163]),
    ("otherprop", [100, 85, 144]),
];

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
