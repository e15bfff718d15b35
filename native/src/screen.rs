//! What goes to the screen: notes and progress to stderr, results to stdout.
use crate::progress::Progress;

/// How much is shown.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// Nothing but errors and, with `json`, the figures.
    pub quiet: bool,
    /// Figures as JSON on stdout.
    pub json: bool,
}

impl Screen {
    /// A line about what happens.
    pub fn note(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// Progress of a piece of work.
    pub fn progress(&self, what: &'static str, total: usize) -> Progress {
        Progress::new(what, total as u64, self.quiet)
    }

    /// The result: as JSON, or else as text unless `quiet`.
    pub fn result(&self, text: &str, json: &str) {
        use std::io::Write;
        let text = if self.json {
            json
        } else if self.quiet {
            ""
        } else {
            text
        };
        // A reader that closed the pipe (`| head`) is no failure of the run.
        let _ = std::io::stdout().write_all(text.as_bytes());
    }
}
