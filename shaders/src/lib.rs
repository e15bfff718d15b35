//! The WGSL kernels of MTE-SLAM without an engine: their sources, a preprocessor that composes
//! them, and one declaration for each kernel.
//!
//! A kernel is a file `NAME.wgsl` and a declaration `src/kernels/NAME.rs` (see [`interface!`]). The
//! declaration names its bindings with element types and access, its parameter struct and its
//! workgroup size once. From it follow
//!
//! - the header of the shader, which [`shader::compose`] writes where the source says `#bindings`,
//! - a struct with one field per binding, generic over its [`Role`](interface::Role): the handles of
//!   buffers in a call, or slices of their contents for code that runs the kernel on the processor.
//!
//! ```
//! use mte_slam_shaders::{kernels::composite, shader};
//!
//! let wgsl = shader::compose(&composite::INTERFACE, &[])?;
//! assert!(wgsl.contains("@group(0) @binding(1) var<storage, read> rays: array<Ray>;"));
//! # Ok::<(), shader::ShaderError>(())
//! ```
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;

#[macro_use]
#[doc(hidden)]
pub mod embed;
#[macro_use]
pub mod interface;
mod constants;
pub mod decoders;
mod expression;
mod header;
pub mod kernels;
pub mod layout;
pub mod random;
pub mod rays;
pub mod shader;
pub mod structs;
pub mod tokens;

pub use constants::CONSTANTS;
