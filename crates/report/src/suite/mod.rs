//! Suites: many runs over scenes, seeds, presets and ablations.
pub mod file;
pub mod options;
pub mod plan;
pub mod program;
pub mod published;
pub mod run_file;
