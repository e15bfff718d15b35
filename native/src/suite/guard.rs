//! One start of a suite at a time in an output folder: two would write the same runs.
//!
//! A file that its owner keeps rewriting, and not a lock of the system, which file systems of
//! clusters may not have; and not a process's number, which outlives the process.
use anyhow::{Context, Result, bail};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread::JoinHandle,
    time::Duration,
};

const NAME: &str = ".at-work";
/// How often the file is rewritten.
const BEAT: Duration = Duration::from_millis(500);
/// A file that stays the same for so long has been left behind by a start that was killed.
const PATIENCE: Duration = Duration::from_millis(2500);

/// While it lives, other starts in the same folder are refused.
pub struct Guard {
    path: PathBuf,
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Guard {
    /// Takes the folder; waits a moment where the last start has not said that it ended.
    pub fn take(folder: &Path) -> Result<Guard> {
        let path = folder.join(NAME);
        let name = path.display();
        if let Ok(first) = fs::read(&path) {
            std::thread::sleep(PATIENCE);
            if fs::read(&path).is_ok_and(|now| now != first) {
                bail!(
                    "{}: found another start of a suite at work there, expected none; wait for \
                     it, or choose another folder with --out",
                    folder.display()
                );
            }
        }
        let beat = |path: &Path, n: u64| fs::write(path, format!("{} {n}\n", std::process::id()));
        beat(&path, 0).with_context(|| format!("{name}: cannot be written"))?;
        let (stop, stopped) = channel();
        let file = path.clone();
        let thread = std::thread::spawn(move || {
            let mut n = 0;
            while let Err(RecvTimeoutError::Timeout) = stopped.recv_timeout(BEAT) {
                n += 1;
                // A full disk is reported by the runs.
                let _ = beat(&file, n);
            }
        });
        Ok(Guard { path, stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_and_what_was_left_behind_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let guard = Guard::take(folder.path()).unwrap();
        let error = Guard::take(folder.path()).err().unwrap().to_string();
        assert!(error.contains("at work") && error.contains("--out"), "{error}");
        drop(guard);
        assert!(!folder.path().join(NAME).exists());
        fs::write(folder.path().join(NAME), "77 3\n").unwrap();
        Guard::take(folder.path()).unwrap();
    }
}
