//! Errors that are the command line's or the configuration's fault, so that `main` can tell them
//! from those of the work by their exit code (2).
pub use mte_slam_report::{UsageError, usage};
