//! The output folder, and the files in it that are not figures or pictures.
pub mod checkpoint;
pub mod folder;
pub mod meshes;
pub mod new_folder;

pub use mte_slam_report::{
    ablation,
    draw::{classes, pictures, plot, sheet},
    metrics, metrics_line, timings, trajectory,
};
