//! The runs of a suite as child processes of this program, and their options as its flags.
pub mod guard;
pub mod options;
pub mod process;
pub mod program;
pub mod run_file;
