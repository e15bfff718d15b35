//! The classes of all built-in scenes.
use alloc::string::ToString;
use mte_slam_types::classes::{Class, ClassTable};

macro_rules! classes {
    ($($id:ident = $raw:literal $color:expr;)*) => {
        /// Compact class indices.
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Kind { $($id),* }
        const TABLE: &[(u16, &str, [u8; 3])] = &[$(($raw, stringify!($id), $color)),*];
    };
}

// Raw ids have gaps and no order, as those of real data sets.
classes! {
    wall = 93 [174, 199, 232];
    floor = 40 [152, 118, 84];
    ceiling = 31 [225, 225, 200];
    window = 97 [60, 190, 230];
    door = 37 [214, 100, 40];
    table = 80 [255, 152, 150];
    chair = 20 [188, 189, 34];
    sofa = 76 [140, 86, 175];
    shelf = 71 [120, 85, 60];
    book = 7 [44, 160, 44];
    lamp = 47 [255, 220, 50];
    vase = 91 [227, 60, 160];
    cup = 14 [0, 60, 255];
    picture = 59 [23, 110, 200];
    rug = 98 [200, 30, 45];
    cushion = 29 [255, 127, 14];
    plant = 44 [20, 100, 40];
    monitor = 87 [60, 60, 75];
    cabinet = 15 [90, 200, 160];
    curtain = 30 [240, 170, 230];
}

/// Returns the class table that all built-in scenes share.
pub fn class_table() -> ClassTable {
    let class = |&(raw_id, name, color): &(u16, &str, [u8; 3])| Class {
        raw_id,
        name: name.to_string(),
        color,
    };
    ClassTable { classes: TABLE.iter().map(class).collect() }
}
