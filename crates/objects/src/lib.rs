#![doc = include_str!("../README.md")]
//! # Conventions
//!
//! Lengths are in metres, in the world frame of the mesh. Room coordinates are (x, y, up) along
//! [`RoomAxes`] through the same origin. Triangles wind counter-clockwise seen from the free side.
//! The same input gives the same bytes on every platform: sums have a fixed order, angles come from
//! `libm`.

mod axes;
mod bounds;
mod document;
mod error;
mod measure;
mod nodes;
mod objects;
mod options;
mod overlap;
mod parts;
mod ply_classes;
mod visible;

pub use axes::{RoomAxes, cameras_up, level_up};
pub use bounds::RoomBox;
pub use document::{FORMAT, VERSION, write_json};
pub use error::ObjectsError;
pub use nodes::write_objects_glb;
pub use objects::{ConfidenceSource, LeftOut, NO_OBJECT, Object, Objects, find_objects};
pub use options::ObjectOptions;
pub use overlap::{ClassBox, Overlap, OverlapPair, box_overlap, class_boxes, group_boxes};
pub use ply_classes::{class_mesh, ply_classes};
