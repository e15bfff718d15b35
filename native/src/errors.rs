//! Errors that are the command line's or the configuration's fault, so that `main` can tell them
//! from those of the work by their exit code.

/// A mistake in the command line or configuration (exit code 2).
#[derive(Debug)]
pub struct UsageError(pub String);

impl std::fmt::Display for UsageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// Return a [`UsageError`] from a function of `anyhow::Result`.
macro_rules! usage {
    ($($argument:tt)*) => {
        return Err($crate::errors::UsageError(format!($($argument)*)).into())
    };
}
pub(crate) use usage;
