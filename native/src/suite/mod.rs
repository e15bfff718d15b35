//! Suites: many runs over scenes, seeds, presets and ablations.
pub mod file;
pub mod guard;
pub mod options;
pub mod plan;
pub mod process;
pub mod published;
pub mod run_file;
