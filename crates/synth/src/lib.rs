#![doc = include_str!("../README.md")]
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

mod builder;
mod bvh;
mod classes;
mod furniture;
mod light;
mod math;
mod mesh;
mod options;
mod render;
mod rooms;
mod scene;
mod sensor;
mod sequence;
mod shape;
mod texture;
mod trajectory;
#[cfg(feature = "varied")]
mod varied;

pub use mesh::SyntheticMesh;
pub use options::{SceneKind, SyntheticOptions};
pub use sequence::SyntheticSequence;
#[cfg(feature = "varied")]
pub use varied::{VariedOptions, VariedSequence};

#[cfg(test)]
mod tests;
