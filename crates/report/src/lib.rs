//! What is said about a run, and how: figures with the protocol they were measured by, as
//! `metrics.json`, tables, pictures and pages.
//!
//! - [`evaluation`], [`class_truth`], [`mesh_evaluation`], [`novel`]: figures of a trajectory, of
//!   rendered views and their classes, of a mesh, and of views that a run never saw;
//! - [`protocol`]: what a figure means, as an id and a sentence; [`metrics`]: `metrics.json` and the table that people read;
//! - [`ablation`]: `ablation.json` and `ablation.md`;
//! - [`suite`]: many runs over scenes, seeds, presets and ablations, and [`suite_report`], what a
//!   suite has measured, as JSON, CSV, HTML and Markdown;
//! - [`draw`]: pictures and plots; [`trajectory`] and [`timings`]: files of a run.
//!
//! Nothing here knows a command line or draws a progress bar: where work takes long, a closure
//! receives what is done.
#![forbid(unsafe_code)]

pub mod ablation;
pub mod class_truth;
pub mod draw;
pub mod errors;
pub mod evaluation;
pub mod files;
pub mod mesh_evaluation;
pub mod metrics;
pub mod metrics_line;
mod metrics_table;
pub mod novel;
pub mod protocol;
pub mod suite;
pub mod suite_report;
mod text_table;
pub mod timings;
pub mod trajectory;

pub use errors::UsageError;
