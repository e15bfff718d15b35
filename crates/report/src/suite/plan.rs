//! The runs of a suite: what each is made from, where it goes, and what is there already.
use super::{
    file::{Scene, Suite},
    options,
    program::{Program, RunOf},
    run_file,
};
use crate::{
    files::{RESUME_FOLDER, read_json, replace_file},
    usage,
};
use anyhow::{Context, Result, bail};
use std::{
    fs,
    path::{Path, PathBuf},
};
use toml::{Table, Value};

/// The variable that names the data root where `--data` does not.
pub const DATA_VARIABLE: &str = "MTE_SLAM_DATA";
/// Why a run failed last time, in its folder.
pub const FAILURE: &str = "failed.txt";
/// How a run was started, in its folder.
pub const STARTED: &str = "started.json";

/// Where recordings are looked for.
#[derive(Clone, Debug)]
pub struct DataRoot {
    /// The folder.
    pub folder: PathBuf,
    /// How it was chosen.
    pub origin: String,
}

impl DataRoot {
    /// `--data`, else the variable, else the suite's own folder, else the working directory.
    pub fn choose(flag: Option<&Path>, suite: &Suite) -> DataRoot {
        if let Some(folder) = flag {
            return DataRoot { folder: folder.to_owned(), origin: "--data".to_owned() };
        }
        if let Some(folder) = std::env::var_os(DATA_VARIABLE).filter(|v| !v.is_empty()) {
            return DataRoot { folder: folder.into(), origin: DATA_VARIABLE.to_owned() };
        }
        match &suite.folder {
            Some(folder) => {
                DataRoot { folder: folder.clone(), origin: "the suite's folder".to_owned() }
            }
            None => DataRoot { folder: ".".into(), origin: "the working directory".to_owned() },
        }
    }
}

/// How far a run is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// All its files are there.
    Finished,
    /// It left a checkpoint to resume from.
    Interrupted,
    /// There is nothing yet.
    Missing,
    /// It failed last time, for this reason.
    Failed(String),
}

/// One run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its name: scene, preset, ablation and seed.
    pub name: String,
    /// Scene.
    pub scene: String,
    /// Preset.
    pub preset: String,
    /// Ablation.
    pub ablation: String,
    /// Seed.
    pub seed: u32,
    /// Its folder.
    pub folder: PathBuf,
    /// The true mesh, where there may be one.
    pub mesh: PathBuf,
    /// Hash of its configuration.
    pub config_hash: String,
    /// Whether its options ask for less than the whole recording.
    pub partial: bool,
    /// Name and version of the program that makes it.
    pub program: String,
    /// The text of its file.
    pub text: String,
}

/// A suite and its runs.
pub struct Plan {
    /// The suite.
    pub suite: Suite,
    /// The output folder.
    pub out: PathBuf,
    /// Name and version of the program that makes the runs.
    pub program: String,
    /// Runs, seed by seed, so that all scenes can be compared long before the last run.
    pub runs: Vec<Run>,
}

impl Plan {
    /// Works out every run; what is wrong with any of them is an error here.
    pub fn new(suite: Suite, out: &Path, data: &DataRoot, program: &dyn Program) -> Result<Plan> {
        let mut runs = Vec::new();
        for &seed in &suite.seeds {
            for scene in &suite.scenes {
                for preset in &suite.presets {
                    for ablation in &suite.ablations {
                        let part = (preset.as_str(), ablation.name.as_str(), seed);
                        runs.push(planned(&suite, out, data, program, scene, part, &ablation.set)?);
                    }
                }
            }
        }
        Ok(Plan { suite, out: out.to_owned(), program: program.name(), runs })
    }

    /// All that is missing of the recordings is one error, with the way to get them.
    pub fn check_data(&self, data: &DataRoot) -> Result<()> {
        let mut missing = Vec::new();
        for scene in &self.suite.scenes {
            let paths = scene.path.iter().map(PathBuf::as_path);
            let options = self.suite.options.iter().chain(&scene.options);
            let more = options.filter_map(|(key, value)| options::path_of(key, value));
            for path in paths.chain(more) {
                let text = path.display().to_string();
                if !data.folder.join(path).exists() && !missing.contains(&text) {
                    missing.push(text);
                }
            }
        }
        if missing.is_empty() {
            return Ok(());
        }
        let root = data.folder.display();
        let download = match self.suite.download.trim() {
            "" => String::new(),
            text => format!("\n\n{text}"),
        };
        usage!(
            "{}: data: found no {} below {root} (by {}), expected the recordings there; --data DIR \
             or {DATA_VARIABLE} names another folder.{download}",
            self.suite.source,
            missing.join(", "),
            data.origin
        );
    }

    /// The folder must be absent, empty, or of an earlier start.
    pub fn check_folder(&self) -> Result<()> {
        let out = &self.out;
        if out.exists() && !out.is_dir() {
            bail!("{}: the output folder: found a file, expected a folder or none", out.display());
        }
        if !out.is_dir() || out.join("runs").is_dir() || out.join("data").is_dir() {
            return Ok(());
        }
        let unreadable = || format!("{}: the output folder cannot be read", out.display());
        if let Some(entry) = fs::read_dir(out).with_context(unreadable)?.next() {
            bail!(
                "{}: the output folder: found files that no suite wrote (such as {}), expected an \
                 empty folder or one of an earlier start. Choose another with --out.",
                out.display(),
                entry.with_context(unreadable)?.file_name().display()
            );
        }
        Ok(())
    }

    /// Writes what every run needs: built-in recordings, and the files of the runs.
    pub fn prepare(&self, program: &dyn Program, note: &dyn Fn(&str)) -> Result<()> {
        for scene in &self.suite.scenes {
            let Some(synthetic) = scene.synthetic else { continue };
            let folder = self.out.join("data").join(synthetic.folder_name());
            if !folder.join("mesh.ply").is_file() {
                note(&format!("writing the built-in recording {}", folder.display()));
                program.write_recording(&folder, synthetic.options())?;
            }
        }
        for run in &self.runs {
            let path = run.folder.join(run_file::NAME);
            // Unchanged files keep their time, by which schedulers judge.
            if fs::read_to_string(&path).ok().as_ref() != Some(&run.text) {
                replace_file(&path, run.text.as_bytes())?;
            }
        }
        Ok(())
    }
}

fn planned(
    suite: &Suite,
    out: &Path,
    data: &DataRoot,
    program: &dyn Program,
    scene: &Scene,
    (preset, ablation, seed): (&str, &str, u32),
    set: &[String],
) -> Result<Run> {
    let name = format!("{}.{preset}.{ablation}.seed{seed}", scene.name);
    let folder = out.join("runs").join(&name);
    let mut options = suite.options.clone();
    options.extend(scene.options.clone());
    // Settings add up; the ablation's come last and win.
    let settings = [suite.options.get("set"), scene.options.get("set")];
    let mut all: Vec<Value> =
        settings.into_iter().flatten().filter_map(Value::as_array).flatten().cloned().collect();
    all.extend(set.iter().cloned().map(Value::String));
    if !all.is_empty() {
        options.insert("set".to_owned(), Value::Array(all));
    }
    options.insert("preset".to_owned(), Value::String(preset.to_owned()));
    options.insert("seed".to_owned(), Value::Integer(seed.into()));
    // As far as there is something to resolve; what is missing is reported all at once.
    let whole = |path: PathBuf| path.canonicalize().unwrap_or(path);
    let root = whole(data.folder.clone());
    options::resolve_paths(&mut options, &root);
    let (dataset, written) = match (&scene.path, &scene.synthetic) {
        (Some(path), _) => {
            let path = whole(root.join(path));
            let text = path.display().to_string();
            (path, text)
        }
        (None, Some(synthetic)) => {
            let name = synthetic.folder_name();
            (out.join("data").join(&name), format!("../../data/{name}"))
        }
        (None, None) => bail!("{}: scenes.{}: found no recording", suite.source, scene.name),
    };
    let place = format!("{}: {name}", suite.source);
    let RunOf { mesh, config_hash, partial } =
        program.run_of(&dataset, &options, preset, &place)?;
    Ok(Run {
        name,
        scene: scene.name.clone(),
        preset: preset.to_owned(),
        ablation: ablation.to_owned(),
        seed,
        folder,
        mesh,
        config_hash,
        partial,
        program: program.name(),
        text: run_file::text(&written, &options)?,
    })
}

impl Run {
    /// What an earlier start left of it. A finished run of other inputs is an error: it would be
    /// mixed in with those of this suite.
    pub fn state(&self) -> Result<State> {
        let folder = &self.folder;
        let metrics = folder.join("metrics.json");
        let file = folder.join(run_file::NAME);
        let unfinished = folder.join(RESUME_FOLDER).exists();
        if metrics.is_file() || unfinished {
            let found = fs::read_to_string(&file).unwrap_or_default();
            if found != self.text {
                let (key, found, expected) = first_difference(&found, &self.text);
                bail!(
                    "{}: this run is of other inputs: {key}: found {found}, expected {expected}. \
                     Remove {} to have it made again, or choose another folder with --out.",
                    file.display(),
                    folder.display()
                );
            }
        }
        if metrics.is_file() && !unfinished {
            self.check_same_program(&metrics)?;
            return Ok(State::Finished);
        }
        if let Ok(reason) = fs::read_to_string(folder.join(FAILURE)) {
            return Ok(State::Failed(reason.trim().to_owned()));
        }
        Ok(if unfinished { State::Interrupted } else { State::Missing })
    }

    fn check_same_program(&self, metrics: &Path) -> Result<()> {
        let json = read_json(metrics)?;
        for (key, found, expected) in [
            ("program", &json["program"], &self.program),
            ("configuration.hash", &json["configuration"]["hash"], &self.config_hash),
        ] {
            if found.as_str() != Some(expected) {
                bail!(
                    "{}: this finished run is of another program or configuration: {key}: found \
                     {found}, expected {expected}. Remove {} to have it made again, or choose \
                     another folder with --out; --report-only takes it as it is.",
                    metrics.display(),
                    self.folder.display()
                );
            }
        }
        Ok(())
    }
}

fn first_difference(found: &str, expected: &str) -> (String, String, String) {
    let read = |text: &str| text.parse::<Table>().unwrap_or_default();
    let (found, expected) = (read(found), read(expected));
    let text = |v: Option<&Value>| v.map_or("none".to_owned(), Value::to_string);
    let mut keys: Vec<&String> = found.keys().chain(expected.keys()).collect();
    keys.sort();
    let different = keys.into_iter().find(|k| found.get(*k) != expected.get(*k));
    match different {
        Some(k) => (k.clone(), text(found.get(k)), text(expected.get(k))),
        None => {
            ("run.toml".to_owned(), "another text".to_owned(), "what this suite writes".to_owned())
        }
    }
}
