//! Errors that are the fault of what was asked for, and not of the work.

/// A mistake in a command line, a configuration or a suite, in words for the person who wrote it.
#[derive(Debug)]
pub struct UsageError(pub String);

impl std::fmt::Display for UsageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// Returns a [`UsageError`] with a formatted message from a function whose error it converts into.
#[macro_export]
macro_rules! usage {
    ($($argument:tt)*) => {
        return Err($crate::UsageError(format!($($argument)*)).into())
    };
}
