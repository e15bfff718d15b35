//! Runs as child processes of this program, some at a time.
//!
//! A run that ends in a crash, or that the system ends for want of memory, takes nothing else with
//! it; and runs do not outlive the suite: each holds one end of a pipe, and ends when the other end
//! is gone, however this process came to its end.
use crate::progress::Progress;
use anyhow::{Context, Result};
use mte_slam_report::{
    files::replace_file,
    suite::{
        plan::{FAILURE, Run, STARTED},
        run_file,
    },
};
use std::{
    collections::VecDeque,
    fs,
    io::{Read, Seek, SeekFrom, Write},
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

/// Set for runs that end when their standard input does.
pub const TIED: &str = "MTE_SLAM_TIED";
/// What a run has said, in its folder.
pub const LOG: &str = "log.txt";
/// How often children are looked at.
const PAUSE: Duration = Duration::from_millis(100);

/// Ends this process when its standard input ends, if it was started as a part of a suite.
pub fn end_with_parent() {
    if std::env::var_os(TIED).is_none() {
        return;
    }
    std::thread::spawn(|| {
        let mut byte = [0];
        let mut input = std::io::stdin();
        // Nothing is ever written; an error means the same as the end.
        while input.read(&mut byte).is_ok_and(|n| n > 0) {}
        std::process::exit(1);
    });
}

/// How one run ended.
pub struct RunOutcome {
    /// Why it failed, if it did.
    pub failure: Option<String>,
    /// How long it took.
    pub time: Duration,
}

struct Running<'a> {
    run: &'a Run,
    child: Child,
    begin: Instant,
    /// Where this start's part of the log begins.
    log_start: u64,
}

/// Makes the runs, `jobs` at a time, in order; `ended` receives each outcome, with how many are done.
pub fn run_all(
    runs: &[&Run],
    jobs: usize,
    progress: &mut Progress,
    ended: &mut dyn FnMut(&Run, &RunOutcome, usize, &Progress),
) -> Result<()> {
    let program = std::env::current_exe().context("this program cannot be found again")?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (cores / jobs.max(1)).max(1);
    let mut waiting: VecDeque<&Run> = runs.iter().copied().collect();
    let mut running: Vec<Running> = Vec::new();
    let mut done = 0;
    // The time left is reckoned from here.
    progress.set(0, String::new);
    loop {
        while running.len() < jobs.max(1)
            && let Some(run) = waiting.pop_front()
        {
            match start(&program, run, jobs, threads) {
                Ok(started) => running.push(started),
                Err(error) => {
                    done += 1;
                    let failure = Some(format!("{error:#}"));
                    ended(run, &RunOutcome { failure, time: Duration::ZERO }, done, progress);
                }
            }
        }
        if running.is_empty() {
            return Ok(());
        }
        let mut i = 0;
        while i < running.len() {
            // `wait` would close the pipe that keeps the run alive.
            let status = running[i].child.try_wait();
            let failure = match status {
                Ok(None) => {
                    i += 1;
                    continue;
                }
                Ok(Some(status)) if status.success() => None,
                Ok(Some(status)) => Some(reason(&running[i], &status.to_string())),
                Err(error) => Some(format!("the run cannot be watched: {error}")),
            };
            let Running { run, begin, .. } = running.swap_remove(i);
            note_failure(run, failure.as_deref());
            done += 1;
            ended(run, &RunOutcome { failure, time: begin.elapsed() }, done, progress);
        }
        if progress.wants_message(done as u64) {
            progress.set(done as u64, || message(&running));
        }
        std::thread::sleep(PAUSE);
    }
}

fn start<'a>(program: &Path, run: &'a Run, jobs: usize, threads: usize) -> Result<Running<'a>> {
    let path = run.folder.join(LOG);
    let name = path.display();
    let mut log = fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(&path)
        .with_context(|| format!("{name}: cannot be written"))?;
    let log_start = log.seek(SeekFrom::End(0)).unwrap_or(0);
    let file = run.folder.join(run_file::NAME);
    let _ = writeln!(log, "== mte-slam run --from {}", file.display());
    let started = serde_json::json!({ "runs_at_a_time": jobs, "threads": threads });
    replace_file(&run.folder.join(STARTED), format!("{started:#}\n").as_bytes())?;
    let mut command = Command::new(program);
    command
        .args(["run", "--from"])
        .arg(&file)
        .env(TIED, "1")
        .stdin(Stdio::piped())
        .stdout(log.try_clone().with_context(|| format!("{name}: cannot be shared"))?)
        .stderr(log);
    if jobs > 1 {
        command.env("RAYON_NUM_THREADS", threads.to_string());
    }
    let child = command.spawn().context("the run cannot be started")?;
    Ok(Running { run, child, begin: Instant::now(), log_start })
}

/// The error that a run has written last, or else how its process ended.
fn reason(running: &Running, status: &str) -> String {
    let said = new_log(running).unwrap_or_default();
    let error = said.rfind("\nerror: ").map(|at| said[at + 8..].trim());
    match error.and_then(|e| e.lines().next()) {
        Some(error) => error.to_owned(),
        None => format!("ended with {status}, see {}", running.run.folder.join(LOG).display()),
    }
}

fn new_log(running: &Running) -> Option<String> {
    let mut file = fs::File::open(running.run.folder.join(LOG)).ok()?;
    file.seek(SeekFrom::Start(running.log_start)).ok()?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).ok()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
}

/// For the report of a later start. What cannot be written is on the screen anyway.
fn note_failure(run: &Run, failure: Option<&str>) {
    let path = run.folder.join(FAILURE);
    let _ = match failure {
        Some(reason) => replace_file(&path, format!("{reason}\n").as_bytes()),
        None => fs::remove_file(&path).map_err(Into::into),
    };
}

/// What the runs under way said last.
fn message(running: &[Running]) -> String {
    let parts = running.iter().map(|r| {
        let said = new_log(r).unwrap_or_default();
        let last = said.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or_default();
        let last: String = last.chars().take(60).collect();
        format!("{}: {last}", r.run.name)
    });
    parts.collect::<Vec<_>>().join("  ")
}
