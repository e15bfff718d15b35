//! Stand-in for the engines.
#![allow(missing_docs)]
use alloc::{string::String, vec::Vec};

#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    #[error("no graphics adapter")]
    NoAdapter { wanted: Option<String>, found: Vec<String> },
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EngineInfo {
    pub kind: &'static str,
    pub adapter: String,
    pub backend: String,
    pub driver: String,
}

pub struct Engine;

impl Engine {
    pub fn cpu() -> Self {
        Engine
    }

    pub fn info(&self) -> EngineInfo {
        EngineInfo {
            kind: "cpu",
            adapter: "x86_64".into(),
            backend: "rust".into(),
            driver: String::new(),
        }
    }
}
