//! What every crate of MTE-SLAM shares: cameras, poses, frames, classes, and the traits through
//! which recordings are read ([`sequence::Source`], [`sequence::Sequence`]).
//!
//! Conventions: camera frame x right, y down, z forward; metres, radians, seconds; poses are
//! `world_from_camera`; depth is along z and 0 means "no measurement"; the center of pixel
//! (u, v) is at image coordinates (u, v), so a pixel covers [u - 0.5, u + 0.5).
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

pub mod camera;
pub mod classes;
pub mod frame;
pub mod hash;
pub mod maths;
pub mod parallel;
pub mod pose;
pub mod safetensors;
pub mod sequence;
pub mod settings;
pub mod trajectory_file;
