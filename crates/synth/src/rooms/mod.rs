//! The built-in scenes: where the furniture stands, and the camera's way through it.
#[cfg(feature = "hall")]
pub mod hall;
pub mod office;
#[cfg(feature = "varied")]
mod plan;
pub mod room;
#[cfg(feature = "varied")]
pub mod varied;
