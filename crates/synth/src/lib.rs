//! The built-in RGB-D sequence: a furnished, textured room, ray-cast as its frames are asked for,
//! with exact poses, labels and a ground-truth mesh. The same seed gives the same bytes.
//!
//! ```
//! use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
//! use mte_slam_types::sequence::Sequence;
//!
//! let mut room = SyntheticSequence::new(SyntheticOptions::tiny());
//! let frame = room.frame(3)?;
//! assert_eq!(frame.depth.len(), room.info().camera.pixels());
//! assert_eq!(frame.truth, room.truth(3));
//! # Ok::<(), mte_slam_types::sequence::SequenceError>(())
//! ```
//!
//! Features: `std` and `threads` (default), and `hall`, the largest scene.
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

pub use mesh::SyntheticMesh;
pub use options::{SceneKind, SyntheticOptions};
pub use sequence::SyntheticSequence;

#[cfg(test)]
mod tests;
