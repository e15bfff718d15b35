//! `results.json` and `results.csv`: every figure of every run under its name and protocol.
//!
//! Figures are taken from `metrics.json` as they are: each number below an object with a
//! `protocol` is one, called by its path. What a later version measures comes along by itself.
use crate::{
    ablation::OverSeeds,
    files::{RESUME_FOLDER, read_json},
    suite::{
        file::Benchmark,
        plan::{Plan, Run, STARTED, State},
    },
};
use anyhow::Result;
use serde::Serialize;
use serde_json::Value;
use std::{
    collections::BTreeMap,
    fmt::Write,
    path::{Path, PathBuf},
};

/// Settings and counts among the figures, which no mean over seeds makes sense of.
const SETTINGS: [&str; 9] = [
    "seed",
    "samples",
    "threshold_cm",
    "small_share_percent",
    "limit",
    "images",
    "unlabelled_id",
    "frames",
    "views",
];

/// One figure.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// Its value, in the unit that its name ends with.
    pub value: f64,
    /// How it was measured.
    pub protocol: String,
}

/// One run, as far as it is.
#[derive(Clone, Debug, Serialize)]
pub struct RunResult {
    /// Its name, which is its folder's below `runs/`.
    pub name: String,
    /// Scene.
    pub scene: String,
    /// Preset.
    pub preset: String,
    /// Ablation.
    pub ablation: String,
    /// Seed.
    pub seed: u32,
    /// `finished`, `interrupted`, `failed` or `missing`.
    pub state: &'static str,
    /// Why there are no figures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Name and version of the program that made it.
    pub program: Option<String>,
    /// Hash of its configuration.
    pub config_hash: Option<String>,
    /// What computed.
    pub engine: Value,
    /// What was read.
    pub sequence: Value,
    /// How many runs shared the machine, and its threads.
    pub started: Value,
    /// Whether the modules of the paper were on: fusion, suppressor.
    pub modules: Option<(bool, bool)>,
    /// How many frames could not be tracked.
    pub lost_frames: usize,
    /// Name -> figure.
    pub figures: BTreeMap<String, Figure>,
    /// What was assumed or met.
    pub warnings: Vec<String>,
    /// Section -> why it is not there.
    pub absent: BTreeMap<String, String>,
    /// Its folder.
    #[serde(skip)]
    pub folder: PathBuf,
    /// The true mesh, where there may be one.
    #[serde(skip)]
    pub mesh: PathBuf,
}

/// Mean and spread over the seeds of one scene, preset and ablation.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Scene.
    pub scene: String,
    /// Preset.
    pub preset: String,
    /// Ablation.
    pub ablation: String,
    /// Seeds that have finished.
    pub seeds: Vec<u32>,
    /// Name -> mean and standard deviation, over the seeds that have the figure.
    pub figures: BTreeMap<String, OverSeeds>,
}

/// Everything.
#[derive(Debug, Serialize)]
pub struct Results {
    /// Name and version of this program.
    pub program: String,
    /// The suite's name.
    pub suite: String,
    /// The published tables that its scenes are named after.
    pub benchmark: Option<Benchmark>,
    /// Every run of the suite, finished or not.
    pub runs: Vec<RunResult>,
    /// Over the seeds.
    pub summary: Vec<Summary>,
}

impl Results {
    /// Collect what is there. A file that cannot be read makes its run a failed one.
    pub fn collect(plan: &Plan) -> Results {
        Results::of_runs(plan, plan.runs.iter().map(read_run).collect())
    }

    /// Of runs that have been read.
    pub fn of_runs(plan: &Plan, runs: Vec<RunResult>) -> Results {
        let mut summary = Vec::new();
        for scene in &plan.suite.scenes {
            for preset in &plan.suite.presets {
                for ablation in &plan.suite.ablations {
                    let part = (scene.name.as_str(), preset.as_str(), ablation.name.as_str());
                    summary.extend(summary_of(&runs, part));
                }
            }
        }
        Results {
            program: plan.program.clone(),
            suite: plan.suite.name.clone(),
            benchmark: plan.suite.benchmark,
            runs,
            summary,
        }
    }

    /// The text of `results.json`.
    pub fn to_json(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// The text of `results.csv`: a line a figure.
    pub fn to_csv(&self) -> String {
        let mut text = String::from(
            "run,scene,preset,ablation,seed,state,program,config_hash,engine,adapter,figure,value,\
             protocol\n",
        );
        for run in &self.runs {
            let engine = |key: &str| run.engine[key].as_str().unwrap_or_default().to_owned();
            let head: Vec<String> = [
                run.name.clone(),
                run.scene.clone(),
                run.preset.clone(),
                run.ablation.clone(),
                run.seed.to_string(),
                run.state.to_owned(),
                run.program.clone().unwrap_or_default(),
                run.config_hash.clone().unwrap_or_default(),
                engine("kind"),
                engine("adapter"),
            ]
            .iter()
            .map(|cell| quoted(cell))
            .collect();
            let head = head.join(",");
            if run.figures.is_empty() {
                let _ = writeln!(text, "{head},,,");
            }
            for (name, figure) in &run.figures {
                let protocol = quoted(&figure.protocol);
                let _ = writeln!(text, "{head},{},{},{protocol}", quoted(name), figure.value);
            }
        }
        text
    }

    /// The finished runs of a scene, preset and ablation, in the order of their seeds.
    pub fn of<'a>(
        &'a self,
        (scene, preset, ablation): (&'a str, &'a str, &'a str),
    ) -> impl Iterator<Item = &'a RunResult> + 'a {
        finished_of(&self.runs, (scene, preset, ablation))
    }

    /// The finished runs.
    pub fn finished(&self) -> impl Iterator<Item = &RunResult> {
        self.runs.iter().filter(|r| r.state == "finished")
    }
}

fn finished_of<'a>(
    runs: &'a [RunResult],
    (scene, preset, ablation): (&'a str, &'a str, &'a str),
) -> impl Iterator<Item = &'a RunResult> + 'a {
    runs.iter().filter(move |r| {
        r.state == "finished" && r.scene == scene && r.preset == preset && r.ablation == ablation
    })
}

fn summary_of(runs: &[RunResult], part: (&str, &str, &str)) -> Option<Summary> {
    let finished: Vec<&RunResult> = finished_of(runs, part).collect();
    let mut figures = BTreeMap::new();
    for run in &finished {
        for name in run.figures.keys() {
            if figures.contains_key(name) {
                continue;
            }
            let values = finished.iter().filter_map(|r| Some(Some(r.figures.get(name)?.value)));
            figures.extend(OverSeeds::of(values).map(|over| (name.clone(), over)));
        }
    }
    (!finished.is_empty()).then(|| Summary {
        scene: part.0.to_owned(),
        preset: part.1.to_owned(),
        ablation: part.2.to_owned(),
        seeds: finished.iter().map(|r| r.seed).collect(),
        figures,
    })
}

impl RunResult {
    /// Nothing of it is known yet.
    pub fn new(run: &Run) -> RunResult {
        RunResult {
            name: run.name.clone(),
            scene: run.scene.clone(),
            preset: run.preset.clone(),
            ablation: run.ablation.clone(),
            seed: run.seed,
            state: "missing",
            reason: None,
            program: None,
            config_hash: None,
            engine: Value::Null,
            sequence: Value::Null,
            started: Value::Null,
            modules: None,
            lost_frames: 0,
            figures: BTreeMap::new(),
            warnings: Vec::new(),
            absent: BTreeMap::new(),
            folder: run.folder.clone(),
            mesh: run.mesh.clone(),
        }
    }
}

fn read_run(run: &Run) -> RunResult {
    let mut result = RunResult::new(run);
    // A report takes finished runs of another version as they are, and says so.
    let finished =
        run.folder.join("metrics.json").is_file() && !run.folder.join(RESUME_FOLDER).exists();
    if !finished {
        (result.state, result.reason) = match run.state() {
            Ok(State::Interrupted) => ("interrupted", None),
            Ok(State::Failed(reason)) => ("failed", Some(reason)),
            Ok(_) => ("missing", None),
            Err(error) => ("failed", Some(format!("{error:#}"))),
        };
        return result;
    }
    match fill(&mut result, &run.folder) {
        Ok(()) => result.state = "finished",
        Err(error) => {
            result.figures.clear();
            (result.state, result.reason) = ("failed", Some(format!("{error:#}")));
        }
    }
    result
}

fn fill(result: &mut RunResult, folder: &Path) -> Result<()> {
    let json = read_json(&folder.join("metrics.json"))?;
    let text = |v: &Value| v.as_str().map(str::to_owned);
    result.program = text(&json["program"]);
    result.config_hash = text(&json["configuration"]["hash"]);
    result.engine = json["engine"].clone();
    result.sequence = json["sequence"].clone();
    result.started = read_json(&folder.join(STARTED)).unwrap_or_default();
    result.modules = modules(&folder.join("config.toml"));
    result.lost_frames = json["lost_frames"].as_array().map_or(0, Vec::len);
    let warnings = json["warnings"].as_array();
    result.warnings = warnings.into_iter().flatten().filter_map(text).collect();
    if let Some(absent) = json["absent"].as_object() {
        let reasons = absent.iter().filter_map(|(k, v)| Some((k.clone(), text(v)?)));
        result.absent = reasons.collect();
    }
    walk(&json, "", None, &mut result.figures);
    complete_protocols(&json, &mut result.figures);
    Ok(())
}

/// A protocol is whole only with what other sections say: how views were rendered, and what the
/// map's classes were learnt from.
fn complete_protocols(json: &Value, figures: &mut BTreeMap<String, Figure>) {
    let views = json["renders"]["protocol"].as_str();
    let sequence = &json["sequence"];
    let learnt = if sequence["labels"] == sequence["truth_labels"] {
        "learnt from the labels that are scored against"
    } else {
        "learnt from other labels than those that are scored against"
    };
    for (path, figure) in figures {
        let section = path.split('.').next().unwrap_or_default();
        if ["depth", "color", "semantics"].contains(&section)
            && let Some(views) = views
        {
            figure.protocol += &format!("; views {views}");
        }
        if path.contains("semantics") {
            figure.protocol += &format!("; {learnt}");
        }
    }
}

/// Every number below an object that names a protocol.
fn walk(json: &Value, path: &str, protocol: Option<&str>, found: &mut BTreeMap<String, Figure>) {
    let Some(object) = json.as_object() else { return };
    let protocol = object.get("protocol").and_then(Value::as_str).or(protocol);
    for (key, value) in object {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match (value.as_f64(), protocol) {
            (Some(value), Some(protocol)) if !SETTINGS.contains(&key.as_str()) => {
                found.insert(path, Figure { value, protocol: protocol.to_owned() });
            }
            _ => walk(value, &path, protocol, found),
        }
    }
}

/// Whether fusion and suppressor were on; without labels neither ever is.
fn modules(path: &Path) -> Option<(bool, bool)> {
    let text = std::fs::read_to_string(path).ok()?;
    let table: toml::Table = text.parse().ok()?;
    let on = |section: &str| table.get(section)?.get("enabled")?.as_bool();
    Some((on("fusion")?, on("suppressor")?))
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_found_by_their_protocols() {
        let json = serde_json::json!({
            "renders": { "protocol": "poses", "unlabelled_id": 3, "frames": [1, 2] },
            "trajectory": { "protocol": "ATE", "aligned_cm": { "rmse": 0.5 }, "pairs": 7 },
            "new": { "inner": { "protocol": "P2", "x_cm": 2, "none": null } },
            "sequence": { "width": 3 },
            "mesh": { "protocol": "M", "seed": 3, "sub": { "protocol": "N", "y_cm": 1.5 } },
        });
        let mut found = BTreeMap::new();
        walk(&json, "", None, &mut found);
        let names: Vec<&str> = found.keys().map(String::as_str).collect();
        let expected =
            ["mesh.sub.y_cm", "new.inner.x_cm", "trajectory.aligned_cm.rmse", "trajectory.pairs"];
        assert_eq!(names, expected);
        assert_eq!(
            (found["mesh.sub.y_cm"].value, found["mesh.sub.y_cm"].protocol.as_str()),
            (1.5, "N")
        );
        assert_eq!(found["new.inner.x_cm"].protocol, "P2");
    }

    #[test]
    fn protocols_are_made_whole() {
        let json = serde_json::json!({
            "renders": { "protocol": "at poses" },
            "sequence": { "labels": "noisy", "truth_labels": "dataset" },
        });
        let figure = |p: &str| Figure { value: 0.0, protocol: p.to_owned() };
        let mut figures = BTreeMap::new();
        figures.insert("semantics.miou_percent".to_owned(), figure("mIoU"));
        figures.insert("mesh.depth_cm".to_owned(), figure("M"));
        complete_protocols(&json, &mut figures);
        assert_eq!(figures["mesh.depth_cm"].protocol, "M");
        let expected =
            "mIoU; views at poses; learnt from other labels than those that are scored against";
        assert_eq!(figures["semantics.miou_percent"].protocol, expected);
    }

    #[test]
    fn cells_with_commas_are_quoted() {
        assert_eq!(quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
        assert_eq!(quoted("plain"), "plain");
    }
}
