//! Evidence for people.
use serde::Serialize;

/// How bad a remark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Good to know.
    Note,
    /// Results will be wrong unless this is meant.
    Warning,
}

/// Something about the recording that people should know.
#[derive(Clone, Debug, Serialize)]
pub struct Remark {
    /// How bad.
    pub severity: Severity,
    /// The evidence, and what to do.
    pub text: String,
}
