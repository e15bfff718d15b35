//! Everything the program writes.
pub mod ablation;
pub mod checkpoint;
pub mod classes;
pub mod colormap;
pub mod folder;
pub mod font;
pub mod meshes;
pub mod metrics;
pub mod metrics_line;
pub mod new_folder;
pub mod pictures;
pub mod plot;
pub mod sheet;
pub mod timings;
pub mod trajectory;
