#![doc = include_str!("../README.md")]
//! # Conventions
//!
//! Camera frame x right, y down, z forward; metres, radians, seconds; poses are
//! `world_from_camera`; depth is along z and 0 means "no measurement"; the centre of pixel
//! (u, v) is at image coordinates (u, v), so a pixel covers [u - 0.5, u + 0.5).
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

pub mod camera;
pub mod classes;
pub mod frame;
pub mod groups;
pub mod hash;
pub mod maths;
pub mod parallel;
pub mod pose;
pub mod safetensors;
pub mod sequence;
pub mod settings;
pub mod trajectory_file;
