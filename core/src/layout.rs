//! Constants shared by the kernels' WGSL and Rust sides.

/// Features a plane cell and level.
pub const CHANNELS: u32 = 16;
/// Resolution levels of a feature plane.
pub const LEVELS: u32 = 2;

/// The constants that shaders may name in `${...}`, with their defaults. `UNROLL` is 1 where
/// shaders may choose unrolled code, and 0 where the compiler is slow and plain loops are better.
pub const CONSTANTS: &[(&str, u32)] = &[("CHANNELS", CHANNELS), ("LEVELS", LEVELS), ("UNROLL", 1)];
