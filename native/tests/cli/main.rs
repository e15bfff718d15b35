//! The program as people run it: exit codes, messages, and the files of an output folder.
//!
//! One test program for all of them: they are linked once, share one run, and keep every core busy
//! to the end.
mod ablation;
mod evaluate;
mod labels;
mod layouts;
mod objects;
mod outputs;
mod program;
mod protocols;
mod python;
mod refusals;
mod resume;
mod segmenter;
mod serve;
mod settings;
