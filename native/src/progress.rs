//! Progress on stderr: a bar on a terminal, a plain line every tenth of the work elsewhere.
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    io::IsTerminal,
    time::{Duration, Instant},
};

/// Progress of one piece of work.
pub struct Progress {
    what: &'static str,
    total: u64,
    /// When the first step was done: it often costs more than the others (first map, pipelines).
    first: Option<(u64, Instant)>,
    /// Steps before the part that runs, and what that part is called.
    part: (u64, String),
    shape: Shape,
}

enum Shape {
    Silent,
    Bar(ProgressBar),
    /// The tenth that was printed last.
    Lines(u64),
}

impl Progress {
    /// Start; `quiet` shows nothing.
    pub fn new(what: &'static str, total: u64, quiet: bool) -> Progress {
        let shape = if quiet {
            Shape::Silent
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(total);
            // The template is a constant; a mistake in it shows as the default style.
            if let Ok(style) =
                ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len}  left {eta}  {msg}")
            {
                bar.set_style(style.progress_chars("=> "));
            }
            bar.set_prefix(what);
            Shape::Bar(bar)
        } else {
            Shape::Lines(0)
        };
        Progress { what, total, first: None, part: (0, String::new()), shape }
    }

    /// A part called `name` begins: what is set from now on counts from `base`.
    pub fn begin_part(&mut self, base: u64, name: String) {
        self.part = (base, name);
    }

    /// `done` of `total` (or, after that of a part's base) is done; `message` tells how it goes.
    pub fn set(&mut self, done: u64, message: impl FnOnce() -> String) {
        let done = self.part.0 + done;
        let name = &self.part.1;
        let message = || {
            let message = message();
            if name.is_empty() { message } else { format!("{name}  {message}") }
        };
        let (first, since) = *self.first.get_or_insert((done, Instant::now()));
        match &mut self.shape {
            Shape::Silent => {}
            Shape::Bar(bar) => {
                bar.set_message(message());
                bar.set_position(done);
            }
            Shape::Lines(printed) => {
                let tenth = done * 10 / self.total.max(1);
                if tenth > *printed {
                    *printed = tenth;
                    let rate = since.elapsed().div_f64((done - first).max(1) as f64);
                    let left = rate.mul_f64(self.total.saturating_sub(done) as f64);
                    let (what, total, message) = (self.what, self.total, message());
                    let line = format!("{what} {done}/{total}  left {}  {message}", clock(left));
                    eprintln!("{}", line.trim_end());
                }
            }
        }
    }

    /// A line that stays, above the bar if there is one.
    pub fn note(&self, text: &str) {
        match &self.shape {
            Shape::Silent => {}
            Shape::Bar(bar) => bar.println(text),
            Shape::Lines(_) => eprintln!("{text}"),
        }
    }

    /// Remove the bar.
    pub fn finish(self) {
        if let Shape::Bar(bar) = &self.shape {
            bar.finish_and_clear();
        }
    }

    /// Whether a message would be shown now: computing one may cost something.
    pub fn wants_message(&self, done: u64) -> bool {
        let done = self.part.0 + done;
        match &self.shape {
            Shape::Silent => false,
            Shape::Bar(_) => true,
            Shape::Lines(printed) => done * 10 / self.total.max(1) > *printed,
        }
    }
}

/// `1:05` or `2:03:04`.
pub fn clock(time: Duration) -> String {
    let s = time.as_secs_f64().round() as u64;
    if s < 3600 {
        format!("{}:{:02}", s / 60, s % 60)
    } else {
        format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_read_as_people_write_them() {
        assert_eq!(clock(Duration::from_secs_f64(64.6)), "1:05");
        assert_eq!(clock(Duration::from_secs(7384)), "2:03:04");
    }
}
