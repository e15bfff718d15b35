//! Pictures and plots of what a run has seen, mapped and estimated.
pub mod classes;
pub mod colormap;
mod font;
pub mod pictures;
pub mod plot;
pub mod sheet;
