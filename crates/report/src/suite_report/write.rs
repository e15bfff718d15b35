//! The report of a suite as files: `report.html`, `report.md`, `results.json`, `results.csv`.
use super::{
    document::{Block, Document, Table},
    html, markdown,
    results::{Results, RunResult},
    scenes, tables,
};
use crate::{files::replace_file, suite::plan::Plan, usage};
use anyhow::Result;
use std::{collections::BTreeSet, fs, path::PathBuf};

/// A report that is in place.
pub struct Written {
    /// `report.html`.
    pub page: PathBuf,
    /// The text of `results.json`.
    pub json: String,
    /// The text of `report.md`, where the report was made now; `None` where one of the same results
    /// was there.
    pub markdown: Option<String>,
}

/// Writes the report of whatever runs are there; unless `anew`, one of the same results is kept.
/// `note` receives what happens and what cannot be shown.
///
/// # Errors
/// No run has finished ([`crate::UsageError`]), or a file cannot be written.
pub fn report(plan: &Plan, anew: bool, note: &dyn Fn(&str)) -> Result<Written> {
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
        return Ok(Written { page, json, markdown: None });
    }
    note("making the report");
    let document = document(plan, &results, note)?;
    let text = markdown::markdown(&document);
    replace_file(&page, html::html(&document).as_bytes())?;
    replace_file(&out.join("report.md"), text.as_bytes())?;
    replace_file(&out.join("results.csv"), csv.as_bytes())?;
    // The last, since it says that the others are there.
    replace_file(&out.join("results.json"), json.as_bytes())?;
    Ok(Written { page, json, markdown: Some(text) })
}

fn document(plan: &Plan, results: &Results, note: &dyn Fn(&str)) -> Result<Document> {
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
    blocks.extend(scenes::blocks(plan, results, &mut |text| notes.push(text)));
    for text in &notes {
        note(&format!("note: {text}"));
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
    let row = |r: &RunResult| {
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
    let programs: BTreeSet<&String> =
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
