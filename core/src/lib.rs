//! Neural RGB-D semantic SLAM after MTE-SLAM, as portable GPU kernels with Rust twins.
//!
//! Conventions: camera frame x right, y down, z forward; metres, radians, seconds; poses are
//! `world_from_camera`; depth is along z and 0 means "no measurement"; the centre of pixel
//! (u, v) is at image coordinates (u, v), so a pixel covers [u - 0.5, u + 0.5).
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

#[macro_use]
pub mod call;
pub mod commands;
pub mod config;
pub mod engine;
pub mod field;
pub mod kernel;
pub mod kernels;
pub mod map;
pub mod slam;
pub mod track;

pub use mte_slam_mesh as mesh;
pub use mte_slam_shaders as shaders;
pub use mte_slam_shaders::{layout, shader};
pub use mte_slam_types::{camera, classes, frame, hash, pose, sequence, settings};
