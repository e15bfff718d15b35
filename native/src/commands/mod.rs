//! One file per subcommand.
pub mod ablate;
pub mod bench;
pub mod convert;
pub mod demo;
pub mod eval;
pub mod evaluate;
pub mod info;
pub mod inspect;
pub mod label;
pub mod mesh;
pub mod objects;
pub mod render;
pub mod run;
pub mod serve;
pub mod settings;
pub mod shaders;
pub mod synth;
