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
