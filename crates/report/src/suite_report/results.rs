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
use anyhow::{Context, Result};
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
    /// Id of the protocol it was measured by; figures compare only where it is equal.
    pub protocol_id: String,
    /// How it was measured, for people.
    pub protocol: String,
}

/// Why the figures of a file cannot be joined with others.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// A section says how it was measured in words alone.
    #[error(
        "{section}: found a protocol without `protocol_id`, expected both; the file is of a version \
         before ids, so the run has to be made again"
    )]
    NoProtocolId {
        /// Path of the object in `metrics.json`.
        section: String,
    },
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
    /// Collects what is there. A file that cannot be read makes its run a failed one.
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

    /// The text of `results.csv`: one line per figure.
    pub fn to_csv(&self) -> String {
        let mut text = String::from(
            "run,scene,preset,ablation,seed,state,program,config_hash,engine,adapter,figure,value,\
             protocol,protocol_id\n",
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
                let _ = writeln!(text, "{head},,,,");
            }
            for (name, figure) in &run.figures {
                let (protocol, id) = (quoted(&figure.protocol), quoted(&figure.protocol_id));
                let name = quoted(name);
                let _ = writeln!(text, "{head},{name},{},{protocol},{id}", figure.value);
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
    walk(&json, "", None, &mut result.figures)
        .with_context(|| folder.join("metrics.json").display().to_string())?;
    complete_protocols(&json, &mut result.figures);
    Ok(())
}

/// A protocol is whole only with what other sections say: how views were rendered, and what the
/// map's classes were learnt from. Ids are put together with `+`.
fn complete_protocols(json: &Value, figures: &mut BTreeMap<String, Figure>) {
    let of = |section: &str| {
        let object = &json[section];
        object["protocol_id"].as_str().zip(object["protocol"].as_str())
    };
    let (renders, novel) = (of("renders"), of("novel_views"));
    let sequence = &json["sequence"];
    let (learnt_id, learnt) = if sequence["labels"] == sequence["truth_labels"] {
        ("labels/scored", "learnt from the labels that are scored against")
    } else {
        ("labels/other", "learnt from other labels than those that are scored against")
    };
    for (path, figure) in figures {
        let views = match path.split('.').next().unwrap_or_default() {
            "depth" | "color" | "semantics" => renders,
            // Those of the section itself say it already.
            "novel_views" => novel.filter(|(id, _)| *id != figure.protocol_id),
            _ => None,
        };
        if let Some((id, views)) = views {
            figure.protocol += &format!("; views {views}");
            figure.protocol_id += &format!("+{id}");
        }
        if path.contains("semantics") {
            figure.protocol += &format!("; {learnt}");
            figure.protocol_id += &format!("+{learnt_id}");
        }
    }
}

/// Every number below an object that names a protocol.
fn walk(
    json: &Value,
    path: &str,
    protocol: Option<(&str, &str)>,
    found: &mut BTreeMap<String, Figure>,
) -> Result<(), ResultsError> {
    let Some(object) = json.as_object() else { return Ok(()) };
    let text = |key: &str| object.get(key).and_then(Value::as_str);
    let protocol = match (text("protocol_id"), text("protocol")) {
        (Some(id), sentence) => Some((id, sentence.unwrap_or_default())),
        (None, None) => protocol,
        (None, Some(_)) => {
            return Err(ResultsError::NoProtocolId { section: path.to_owned() });
        }
    };
    for (key, value) in object {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match (value.as_f64(), protocol) {
            (Some(value), Some((id, sentence))) if !SETTINGS.contains(&key.as_str()) => {
                let (protocol_id, protocol) = (id.to_owned(), sentence.to_owned());
                found.insert(path, Figure { value, protocol_id, protocol });
            }
            _ => walk(value, &path, protocol, found)?,
        }
    }
    Ok(())
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
            "renders": {
                "protocol": "poses", "protocol_id": "r@1", "unlabelled_id": 3, "frames": [1, 2]
            },
            "trajectory": {
                "protocol": "ATE", "protocol_id": "a@1", "aligned_cm": { "rmse": 0.5 }, "pairs": 7
            },
            "new": { "inner": { "protocol": "P2", "protocol_id": "p@2", "x_cm": 2, "none": null } },
            "sequence": { "width": 3 },
            "mesh": {
                "protocol": "M",
                "protocol_id": "m@1",
                "seed": 3,
                "sub": { "protocol": "N", "protocol_id": "n@1", "y_cm": 1.5 },
            },
        });
        let mut found = BTreeMap::new();
        walk(&json, "", None, &mut found).unwrap();
        let names: Vec<&str> = found.keys().map(String::as_str).collect();
        let expected =
            ["mesh.sub.y_cm", "new.inner.x_cm", "trajectory.aligned_cm.rmse", "trajectory.pairs"];
        assert_eq!(names, expected);
        assert_eq!(
            (found["mesh.sub.y_cm"].value, found["mesh.sub.y_cm"].protocol.as_str()),
            (1.5, "N")
        );
        assert_eq!(found["new.inner.x_cm"].protocol, "P2");
        assert_eq!(found["mesh.sub.y_cm"].protocol_id, "n@1");
        assert_eq!(found["trajectory.aligned_cm.rmse"].protocol_id, "a@1");
    }

    #[test]
    fn files_from_before_ids_are_refused() {
        let json = serde_json::json!({ "mesh": { "depth": { "protocol": "M", "l1_cm": 1.0 } } });
        let error = walk(&json, "", None, &mut BTreeMap::new()).unwrap_err();
        assert_eq!(error, ResultsError::NoProtocolId { section: "mesh.depth".to_owned() });
        let message = error.to_string();
        assert!(message.contains("`protocol_id`") && message.contains("made again"), "{message}");
    }

    #[test]
    fn protocols_are_made_whole() {
        let json = serde_json::json!({
            "renders": { "protocol": "at poses", "protocol_id": "at@1" },
            "novel_views": { "protocol": "elsewhere", "protocol_id": "new@1" },
            "sequence": { "labels": "noisy", "truth_labels": "dataset" },
        });
        let figure = |p: &str| Figure {
            value: 0.0,
            protocol: p.to_owned(),
            protocol_id: format!("{}@1", p.to_lowercase()),
        };
        let mut figures = BTreeMap::new();
        figures.insert("semantics.miou_percent".to_owned(), figure("mIoU"));
        figures.insert("mesh.depth_cm".to_owned(), figure("M"));
        figures.insert("novel_views.depth.l1_cm".to_owned(), figure("D"));
        complete_protocols(&json, &mut figures);
        assert_eq!(figures["mesh.depth_cm"].protocol, "M");
        let expected =
            "mIoU; views at poses; learnt from other labels than those that are scored against";
        assert_eq!(figures["semantics.miou_percent"].protocol, expected);
        let id = |path: &str| figures[path].protocol_id.as_str();
        assert_eq!(id("semantics.miou_percent"), "miou@1+at@1+labels/other");
        assert_eq!((id("mesh.depth_cm"), id("novel_views.depth.l1_cm")), ("m@1", "d@1+new@1"));
    }

    #[test]
    fn cells_with_commas_are_quoted() {
        assert_eq!(quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
        assert_eq!(quoted("plain"), "plain");
    }
}
