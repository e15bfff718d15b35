//! The program as people run it: exit codes, messages, and the files of an output folder.
mod ablation;
mod labels;
mod outputs;
mod program;
mod refusals;
mod settings;
