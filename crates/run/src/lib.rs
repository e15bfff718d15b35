//! A run from its first frame to the end of its last optimisation.
//!
//! [`Run`] takes frames from an [`Input`] (a recording, a stream, a live camera) and gives them to
//! [`mte_slam_core::slam::Slam`]. What belongs to the program around it (time, an event loop,
//! what is shown) is its [`Host`]. Between any two steps the run can be saved, and a
//! [`SavedRun`] goes on from there, to the same bytes.
//!
//! ```
//! use mte_slam_core::{config::Config, engine::Engine};
//! use mte_slam_run::{Event, Host, Run};
//! use mte_slam_synth::{SyntheticOptions, SyntheticSequence};
//! use mte_slam_types::sequence::Sequence;
//!
//! struct Quiet;
//! impl Host for Quiet {
//!     fn event(&mut self, event: Event<'_>) {
//!         if let Event::Processed { report, .. } = event {
//!             println!("{:?}", report.world_from_camera.translation);
//!         }
//!     }
//! }
//!
//! let options = SyntheticOptions { width: 48, height: 36, frames: 2, ..SyntheticOptions::tiny() };
//! let mut room = SyntheticSequence::new(options);
//! let mut config = Config::preset("fast").unwrap_or_default();
//! (config.mapping.first_iterations, config.mapping.rays) = (4, 128);
//! (config.mapping.final_iterations, config.mapping.semantic_iterations) = (2, 2);
//! # pollster::block_on(async {
//! let mut run = Run::new(Engine::cpu(), config, room.info()).await?;
//! run.to_end(&mut room, &mut Quiet).await?;
//! assert_eq!(run.slam().trajectory().len(), 2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! # }).unwrap();
//! ```
#![forbid(unsafe_code)]

mod host;
mod input;
mod log;
mod run;
mod saved;

pub use host::{Event, Host};
pub use input::{Input, Live};
pub use log::{FrameLog, Log};
pub use mte_slam_core::slam::Turn;
pub use run::{Run, RunError, Step};
pub use saved::SavedRun;
