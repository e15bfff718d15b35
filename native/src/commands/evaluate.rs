//! `mte-slam evaluate`: a suite of runs, and its report.
use crate::{
    args::{EngineArgs, EngineChoice, EvaluateArgs},
    engine,
    errors::usage,
    output::{folder::replace_file, metrics_line},
    progress::clock,
    report::{
        document::{Block, Document, Table},
        html, markdown,
        results::Results,
        scenes, tables,
    },
    screen::Screen,
    suite::{
        file::Suite,
        guard::Guard,
        plan::{DataRoot, Plan, Run, State},
        process,
    },
};
use anyhow::{Result, bail};
use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

/// Cores that a run on the processor uses well.
const CORES_A_RUN: usize = 4;

/// Run a suite, or what is asked of it.
pub fn run(args: &EvaluateArgs, screen: Screen) -> Result<()> {
    let suite = Suite::read(&args.suite)?;
    let out = args.out.clone().unwrap_or_else(|| Path::new("out").join(&suite.name));
    let data = DataRoot::choose(args.data.as_deref(), &suite);
    let plan = Plan::new(suite, &out, &data)?;
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
    plan.prepare(&|text| screen.note(text))?;
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

/// The runs, with progress; gives back those that failed, and why.
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

/// Write the report of whatever runs are there; unless `anew`, one of the same results is kept.
fn report(plan: &Plan, anew: bool, screen: Screen) -> Result<()> {
    let out = &plan.out;
    let results = Results::collect(plan);
    if results.finished().next().is_none() {
        let what = out.join("runs");
        usage!("{}: found no finished run, expected at least one to report", what.display());
    }
    let (json, csv) = (results.to_json()?, results.to_csv());
    let page = out.join("report.html");
    let unchanged = |name: &str, text: &str| {
        fs::read_to_string(out.join(name)).is_ok_and(|found| found == text)
    };
    let same = unchanged("results.json", &json) && unchanged("results.csv", &csv);
    if same && page.is_file() && !anew {
        screen.note(&format!("the report is up to date: {}", page.display()));
        screen.result("", &json);
        return Ok(());
    }
    screen.note("making the report");
    let document = document(plan, &results, screen)?;
    let text = markdown::markdown(&document);
    replace_file(&page, html::html(&document).as_bytes())?;
    replace_file(&out.join("report.md"), text.as_bytes())?;
    replace_file(&out.join("results.csv"), csv.as_bytes())?;
    // The last, since it says that the others are there.
    replace_file(&out.join("results.json"), json.as_bytes())?;
    screen.result(&format!("{text}\nwritten to {}\n", page.display()), &json);
    Ok(())
}

fn document(plan: &Plan, results: &Results, screen: Screen) -> Result<Document> {
    let suite = &plan.suite;
    let mut blocks = Vec::new();
    let finished = results.finished().count();
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    blocks.push(Block::Text(format!(
        "{} of {} finished: {} with {}, {} and {}. Made by {}.",
        finished,
        count(results.runs.len(), "run"),
        count(suite.scenes.len(), "scene"),
        count(suite.seeds.len(), "seed"),
        count(suite.presets.len(), "preset"),
        count(suite.ablations.len(), "ablation"),
        results.program
    )));
    if !suite.note.is_empty() {
        blocks.push(Block::Text(suite.note.clone()));
    }
    blocks.push(Block::Text(
        "± is the sample standard deviation over seeds; n is how many seeds a cell has where some \
         are missing. A mean over scenes is taken seed by seed, over the scenes that have the \
         figure, as soon as all of them have a finished run. Every column has one protocol; \
         published figures stand apart, with theirs."
            .to_owned(),
    ));
    let missing: Vec<String> = results
        .runs
        .iter()
        .filter(|r| r.state != "finished")
        .map(|r| match &r.reason {
            Some(reason) => format!("{}: {}: {reason}", r.name, r.state),
            None => format!("{}: {}", r.name, r.state),
        })
        .collect();
    if !missing.is_empty() {
        blocks.push(Block::Text("Runs without results:".to_owned()));
        blocks.push(Block::List(missing));
    }
    blocks.extend(tables::blocks(plan, results)?);
    let mut notes = Vec::new();
    blocks.extend(scenes::blocks(plan, results, &mut |note| notes.push(note)));
    for note in &notes {
        screen.note(&format!("note: {note}"));
    }
    if !notes.is_empty() {
        blocks.push(Block::Text("What could not be shown:".to_owned()));
        blocks.push(Block::List(notes));
    }
    blocks.push(Block::Heading(2, "Runs".to_owned()));
    blocks.push(Block::Table(runs_table(results)));
    blocks.push(Block::Heading(2, "All figures".to_owned()));
    blocks.push(Block::Text(
        "Every figure of every run, with its protocol, is in results.json and results.csv."
            .to_owned(),
    ));
    Ok(Document { title: suite.title.clone(), blocks })
}

fn runs_table(results: &Results) -> Table {
    let head = ["run", "state", "lost frames", "configuration", "program", "engine", "adapter"];
    let row = |r: &crate::report::results::RunResult| {
        let engine = |key: &str| r.engine[key].as_str().unwrap_or("-").to_owned();
        let lost = if r.state == "finished" { r.lost_frames.to_string() } else { "-".to_owned() };
        vec![
            r.name.clone(),
            r.state.to_owned(),
            lost,
            r.config_hash.clone().unwrap_or("-".to_owned()),
            r.program.clone().unwrap_or("-".to_owned()),
            engine("kind"),
            engine("adapter"),
        ]
    };
    let programs: std::collections::BTreeSet<&String> =
        results.finished().filter_map(|r| r.program.as_ref()).collect();
    let mut notes = Vec::new();
    if programs.len() > 1 {
        notes.push("The runs are of several versions of the program.".to_owned());
    }
    Table {
        caption: "Runs, each in the folder of its name below runs/, with its inputs (run.toml), \
                  configuration, log and figures"
            .to_owned(),
        notes,
        head: head.map(str::to_owned).to_vec(),
        labels: 2,
        rows: results.runs.iter().map(row).collect(),
        published: false,
    }
}
