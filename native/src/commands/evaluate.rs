//! `mte-slam evaluate`: a suite of runs, and its report.
use crate::{
    args::{EngineArgs, EngineChoice, EvaluateArgs},
    engine,
    output::metrics_line,
    progress::clock,
    screen::Screen,
    suite::{guard::Guard, process, program::RunCommand},
};
use anyhow::{Result, bail};
use mte_slam_report::{
    suite::{
        file::Suite,
        plan::{DataRoot, Plan, Run, State},
    },
    suite_report::write,
};
use std::{
    path::Path,
    time::{Duration, Instant},
};

/// Cores that a run on the processor uses well.
const CORES_A_RUN: usize = 4;

/// Runs a suite, or what is asked of it.
pub fn run(args: &EvaluateArgs, screen: Screen) -> Result<()> {
    let suite = Suite::read(&args.suite, &RunCommand)?;
    let out = args.out.clone().unwrap_or_else(|| Path::new("out").join(&suite.name));
    let data = DataRoot::choose(args.data.as_deref(), &suite);
    let plan = Plan::new(suite, &out, &data, &RunCommand)?;
    plan.check_folder()?;
    if args.report_only {
        return report(&plan, true, screen);
    }
    let states: Vec<State> = plan.runs.iter().map(Run::state).collect::<Result<_>>()?;
    if args.dry_run {
        list(&plan, &states, screen)?;
        return plan.check_data(&data);
    }
    plan.check_data(&data)?;
    plan.prepare(&RunCommand, &|text| screen.note(text))?;
    if args.prepare {
        return list(&plan, &states, screen);
    }
    let todo: Vec<&Run> = plan
        .runs
        .iter()
        .zip(&states)
        .filter(|(_, s)| **s != State::Finished)
        .map(|p| p.0)
        .collect();
    let kept = plan.runs.len() - todo.len();
    let failed = if todo.is_empty() {
        screen.note(&format!("{}: all {kept} runs finished before", out.display()));
        Vec::new()
    } else {
        let _alone = Guard::take(&out)?;
        let jobs = args.jobs.unwrap_or_else(|| default_jobs(&plan));
        screen.note(&format!(
            "{}: {} runs, {kept} finished before, {jobs} at a time; into {}",
            plan.suite.source,
            plan.runs.len(),
            out.display()
        ));
        work(&todo, jobs.min(todo.len()), screen)?
    };
    report(&plan, false, screen)?;
    if !failed.is_empty() {
        let reasons: Vec<String> =
            failed.iter().map(|(run, reason)| format!("\n  {run}: {reason}")).collect();
        bail!("{} of {} runs failed:{}", failed.len(), plan.runs.len(), reasons.concat());
    }
    Ok(())
}

/// The runs, with progress; returns those that failed, and why.
fn work(todo: &[&Run], jobs: usize, screen: Screen) -> Result<Vec<(String, String)>> {
    let begin = Instant::now();
    let mut progress = screen.progress("runs", todo.len());
    let mut failed = Vec::new();
    let mut times: Vec<Duration> = Vec::new();
    process::run_all(todo, jobs, &mut progress, &mut |run, ended, done, progress| {
        times.push(ended.time);
        // By whole runs: those under way count as not begun, so this is rather too much.
        let mean = times.iter().sum::<Duration>().div_f64(times.len() as f64);
        let left = mean.mul_f64((todo.len() - done).div_ceil(jobs) as f64);
        let what = match &ended.failure {
            None => metrics_line::of_folder(&run.folder),
            Some(reason) => format!("FAILED: {reason}"),
        };
        progress.note(&format!(
            "{done}/{} {}: {what}, {}; left {}",
            todo.len(),
            run.name,
            clock(ended.time),
            clock(left)
        ));
        if let Some(reason) = &ended.failure {
            failed.push((run.name.clone(), reason.clone()));
        }
    })?;
    progress.finish();
    screen.note(&format!("{} runs in {}", todo.len(), clock(begin.elapsed())));
    Ok(failed)
}

/// One run at a time on a graphics adapter, which it fills; else one for every few cores.
fn default_jobs(plan: &Plan) -> usize {
    let options = &plan.suite.options;
    let text = |key: &str| options.get(key).and_then(toml::Value::as_str);
    let engine = match text("engine") {
        Some("cpu") => EngineChoice::Cpu,
        Some("gpu") => EngineChoice::Gpu,
        _ => EngineChoice::Auto,
    };
    let adapter = text("adapter").map(str::to_owned);
    if engine::takes_adapter(&EngineArgs { engine, adapter }) {
        return 1;
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    (cores / CORES_A_RUN).max(1)
}

/// The runs and how far they are.
fn list(plan: &Plan, states: &[State], screen: Screen) -> Result<()> {
    let mut text = String::new();
    let mut json = Vec::new();
    for (run, state) in plan.runs.iter().zip(states) {
        let state = match state {
            State::Finished => "finished".to_owned(),
            State::Interrupted => "interrupted".to_owned(),
            State::Missing => "to do".to_owned(),
            State::Failed(reason) => format!("failed: {reason}"),
        };
        text += &format!("{}  {state}\n", run.name);
        json.push(serde_json::json!({
            "name": run.name,
            "folder": run.folder,
            "state": state,
            "config_hash": run.config_hash,
        }));
    }
    let finished = states.iter().filter(|s| **s == State::Finished).count();
    text += &format!("{} runs, {finished} finished; in {}\n", states.len(), plan.out.display());
    screen.result(&text, &format!("{:#}\n", serde_json::json!({ "runs": json })));
    Ok(())
}

/// Writes the report of whatever runs are there; unless `anew`, one of the same results is kept.
fn report(plan: &Plan, anew: bool, screen: Screen) -> Result<()> {
    let written = write::report(plan, anew, &|text| screen.note(text))?;
    let text = match &written.markdown {
        Some(text) => format!("{text}\nwritten to {}\n", written.page.display()),
        None => {
            screen.note(&format!("the report is up to date: {}", written.page.display()));
            String::new()
        }
    };
    screen.result(&text, &written.json);
    Ok(())
}
