//! SUITE.toml: which scenes, seeds, presets and ablations are measured.
use super::program::Program;
use crate::usage;
use anyhow::Result;
use mte_slam_synth::{SceneKind, SyntheticOptions};
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};
use toml::Table;

/// Suites that come with the program, by name.
const INCLUDED: [(&str, &str); 5] = [
    ("built-in", include_str!("../../suites/built-in.toml")),
    ("recordings", include_str!("../../suites/recordings.toml")),
    ("replica", include_str!("../../suites/replica.toml")),
    ("scannet", include_str!("../../suites/scannet.toml")),
    ("tiny", include_str!("../../suites/tiny.toml")),
];

/// A suite as its file says it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    /// Its name, by default the file's.
    #[serde(default)]
    pub name: String,
    /// The report's first line.
    #[serde(default)]
    pub title: String,
    /// What the reader of the report should know.
    #[serde(default)]
    pub note: String,
    /// The published table that scenes are named after: `replica` or `scannet`.
    pub benchmark: Option<Benchmark>,
    /// Where missing recordings come from.
    #[serde(default)]
    pub download: String,
    /// Seeds; one run of everything else for each.
    pub seeds: Vec<u32>,
    /// Presets to start from.
    pub presets: Vec<String>,
    /// Options of `mte-slam run` for all scenes.
    #[serde(default)]
    pub options: Table,
    /// Sets of changed settings.
    #[serde(default)]
    pub ablations: Vec<Ablation>,
    /// Recordings.
    pub scenes: Vec<Scene>,
    /// Where it was read, for messages.
    #[serde(skip)]
    pub source: String,
    /// The folder of its file; none for an included one.
    #[serde(skip)]
    pub folder: Option<PathBuf>,
}

/// A published benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Benchmark {
    /// Eight synthetic scenes.
    Replica,
    /// Real ones, of which the paper takes four.
    ScanNet,
}

/// A named set of changed settings.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ablation {
    /// Its name.
    pub name: String,
    /// `key=value`, as after `--set`.
    #[serde(default)]
    pub set: Vec<String>,
}

/// A recording, from files or built in.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Its name; for a benchmark that of the published table.
    pub name: String,
    /// The recording, below the data root.
    pub path: Option<PathBuf>,
    /// A built-in one instead.
    pub synthetic: Option<Synthetic>,
    /// Options of `mte-slam run` for this scene alone.
    #[serde(default)]
    pub options: Table,
}

/// A built-in recording.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Synthetic {
    /// `room`, `office` or `hall`.
    pub scene: SceneKind,
    /// Its frames.
    pub frames: usize,
    /// Width of its images \[pixels\]; the height is three quarters of it.
    #[serde(default = "default_width")]
    pub width: u32,
    /// Changes colours, small things and the hand's shake.
    #[serde(default)]
    pub seed: u64,
    /// Noise and holes as of a Kinect.
    #[serde(default)]
    pub depth_noise: bool,
}

fn default_width() -> u32 {
    320
}

impl Synthetic {
    /// The core's options.
    pub fn options(&self) -> SyntheticOptions {
        SyntheticOptions {
            width: self.width,
            height: self.width / 4 * 3,
            frames: self.frames,
            seed: self.seed,
            scene: self.scene,
            depth_noise: self.depth_noise,
        }
    }

    /// A folder's name that states all of it.
    pub fn folder_name(&self) -> String {
        let scene = self.scene.name();
        let noise = if self.depth_noise { "-noise" } else { "" };
        format!("{scene}-{}frames-{}px-seed{}{noise}", self.frames, self.width, self.seed)
    }
}

impl Suite {
    /// Reads a file, or take the included suite of that name.
    pub fn read(path: &Path, program: &dyn Program) -> Result<Suite> {
        let name = path.display().to_string();
        if !path.exists()
            && let Some((name, text)) = INCLUDED.iter().find(|(n, _)| path == Path::new(n))
        {
            let suite = Suite::parse(&format!("the included suite {name}"), name, text, program)?;
            return Ok(suite);
        }
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) => usage!(
                "{name}: the suite cannot be read: {e}; expected a file, or an included suite: {}",
                INCLUDED.map(|(name, _)| name).join(", ")
            ),
        };
        let stem = path.file_stem().map_or(String::new(), |s| s.to_string_lossy().into_owned());
        let mut suite = Suite::parse(&name, &stem, &text, program)?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        suite.folder = Some(folder.unwrap_or(Path::new(".")).to_owned());
        Ok(suite)
    }

    /// The suite of a text; `source` starts messages, `name` is its name where it says none.
    pub fn parse(source: &str, name: &str, text: &str, program: &dyn Program) -> Result<Suite> {
        let mut suite: Suite = match toml::from_str(text) {
            Ok(suite) => suite,
            Err(e) => usage!("{source}: not a suite: {}", e.to_string().trim_end()),
        };
        suite.source = source.to_owned();
        if suite.name.is_empty() {
            suite.name = name.to_owned();
        }
        if suite.title.is_empty() {
            suite.title = format!("Suite {}", suite.name);
        }
        if suite.ablations.is_empty() {
            suite.ablations.push(Ablation { name: "base".to_owned(), set: Vec::new() });
        }
        suite.check(program)?;
        Ok(suite)
    }

    fn check(&self, program: &dyn Program) -> Result<()> {
        let source = &self.source;
        named(source, "name", &self.name)?;
        unique(source, "seeds", self.seeds.iter().map(u32::to_string))?;
        unique(source, "presets", self.presets.iter().cloned())?;
        unique(source, "ablations.name", self.ablations.iter().map(|a| a.name.clone()))?;
        unique(source, "scenes.name", self.scenes.iter().map(|s| s.name.clone()))?;
        for preset in &self.presets {
            let known = mte_slam_core::config::Config::PRESETS;
            if !known.contains(&preset.as_str()) {
                usage!(
                    "{source}: presets: found `{preset}`, expected some of {}",
                    known.join(", ")
                );
            }
        }
        for ablation in &self.ablations {
            named(source, "ablations.name", &ablation.name)?;
        }
        check_options(program, &format!("{source}: options"), &self.options)?;
        for scene in &self.scenes {
            named(source, "scenes.name", &scene.name)?;
            let place = format!("{source}: scenes.{}", scene.name);
            check_options(program, &format!("{place}.options"), &scene.options)?;
            match (&scene.path, &scene.synthetic) {
                (Some(_), None) => {}
                (None, Some(s)) => {
                    if !(2..=2000).contains(&s.frames) {
                        usage!("{place}.synthetic.frames: found {}, expected 2 to 2000", s.frames);
                    }
                    if !(32..=1280).contains(&s.width) || s.width % 4 != 0 {
                        usage!(
                            "{place}.synthetic.width: found {}, expected a multiple of 4 from 32 \
                             to 1280",
                            s.width
                        );
                    }
                }
                (Some(_), Some(_)) => {
                    usage!("{place}: found `path` and `synthetic`, expected one of them")
                }
                (None, None) => {
                    usage!("{place}: found neither `path` nor `synthetic`, expected one")
                }
            }
        }
        Ok(())
    }
}

/// Keys of a table of options; values are checked where they are used.
fn check_options(program: &dyn Program, place: &str, options: &Table) -> Result<()> {
    for key in ["seed", "preset"] {
        if options.contains_key(key) {
            usage!("{place}: found `{key}`, expected it in `{key}s` at the top of the suite");
        }
    }
    program.check_options(options, place)
}

/// A name that can be a part of a folder's.
fn named(source: &str, key: &str, name: &str) -> Result<()> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > 60 || !name.chars().all(allowed) {
        usage!(
            "{source}: {key}: found `{name}`, expected 1 to 60 of the letters a-z, digits, `-` and \
             `_` (it names folders)"
        );
    }
    Ok(())
}

fn unique(source: &str, key: &str, values: impl Iterator<Item = String>) -> Result<()> {
    let mut seen = BTreeSet::new();
    for value in values {
        if !seen.insert(value.clone()) {
            usage!("{source}: {key}: found {value} twice, expected it once");
        }
    }
    if seen.is_empty() {
        usage!("{source}: {key}: found none, expected at least one");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{UsageError, suite::program::tests::Pretend};

    const GOOD: &str = "seeds = [1]\npresets = ['fast']\n[[scenes]]\nname = 'a'\n\
                        synthetic = { scene = 'room', frames = 4 }\n";

    fn message(text: &str) -> String {
        let error = Suite::parse("s.toml", "s", text, &Pretend).unwrap_err();
        assert!(error.downcast_ref::<UsageError>().is_some());
        let message = error.to_string();
        assert!(message.starts_with("s.toml: "), "{message}");
        message
    }

    #[test]
    fn included_suites_are_valid() {
        for (name, _) in INCLUDED {
            let suite = Suite::read(Path::new(name), &Pretend).unwrap();
            assert_eq!(suite.name, name);
            let needs_data = suite.scenes.iter().any(|s| s.path.is_some());
            assert_eq!(needs_data, !suite.download.is_empty(), "{name} says where its data is");
        }
        let replica = Suite::read(Path::new("replica"), &Pretend).unwrap();
        assert_eq!((replica.scenes.len(), replica.seeds.len()), (8, 5));
        let scannet = Suite::read(Path::new("scannet"), &Pretend).unwrap();
        assert_eq!(scannet.scenes.len(), 4);
    }

    #[test]
    fn defaults_are_filled_in() {
        let suite = Suite::parse("s.toml", "s", GOOD, &Pretend).unwrap();
        assert_eq!((suite.name.as_str(), suite.ablations[0].name.as_str()), ("s", "base"));
        let synthetic = suite.scenes[0].synthetic.unwrap();
        assert_eq!(synthetic.folder_name(), "room-4frames-320px-seed0");
        assert_eq!(synthetic.options().height, 240);
    }

    #[test]
    fn mistakes_are_named() {
        let with = |more: &str| format!("{more}\n{GOOD}");
        let m = message(&with("sceens = 3"));
        assert!(m.contains("`sceens`") && m.contains("`scenes`"), "{m}");
        assert!(message(&GOOD.replace("[1]", "[1, 2, 1]")).contains("seeds: found 1 twice"));
        assert!(message(&GOOD.replace("[1]", "[]")).contains("seeds: found none"));
        let m = message(&GOOD.replace("'fast'", "'quick'"));
        assert!(m.contains("presets: found `quick`") && m.contains("replica"), "{m}");
        let m = message(&format!("{GOOD}options = {{ sacle = 0.5 }}"));
        assert!(m.contains("scenes.a.options") && m.contains("`sacle`"), "{m}");
        assert!(message(&format!("{GOOD}options = {{ seed = 5 }}")).contains("`seeds`"));
        assert!(message(&format!("{GOOD}path = 'x'")).contains("expected one of them"));
        assert!(message(&GOOD.replace("'a'", "'a.b'")).contains("scenes.name: found `a.b`"));
        assert!(message(&GOOD.replace("frames = 4", "frames = 1")).contains("found 1, expected 2"));
        let m = message(&GOOD.replace("'room'", "'cellar'"));
        assert!(m.contains("`cellar`") && m.contains("`room`"), "{m}");
        assert!(message(&with("benchmark = 'tum'")).contains("`scannet`"));
        let twice = format!("{GOOD}[[scenes]]\nname = 'a'\npath = 'x'");
        assert!(message(&twice).contains("scenes.name: found a twice"));
        assert!(message("seeds = [").contains("not a suite"));
    }
}
