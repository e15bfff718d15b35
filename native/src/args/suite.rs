//! Suites.
use super::at_least_one;
use clap::{Args, ValueHint};
use std::path::PathBuf;

/// The manual of `evaluate`.
pub const EVALUATE: &str = "Run a suite: every scene with every seed, preset and ablation, each a run of its own, and report \
all of them. SUITE is a file, or one that comes with the program:\n    \
built-in     two ray-cast scenes, 3 seeds; needs no data\n    \
replica      8 scenes, 5 seeds, beside the paper's Tables II to VI\n    \
scannet      4 scenes, 5 seeds, beside the paper's Table I\n    \
recordings   built-in scenes and three recordings: a pattern for your own\n    \
tiny         two runs of seconds, to try out a scheduler\n\n\
A suite of your own:\n    \
seeds = [1, 2, 3]\n    \
presets = [\"fast\"]\n    \
[options]                  # any option of `mte-slam run`, with _ for -\n    \
frames = 100\n    \
[[ablations]]              # optional: settings as after --set\n    \
name = \"both\"\n    \
[[ablations]]\n    \
name = \"no-fusion\"\n    \
set = [\"fusion.enabled=false\"]\n    \
[[scenes]]\n    \
name = \"desk\"\n    \
path = \"tum/fr1_desk\"      # below --data, $MTE_SLAM_DATA, or the suite's own folder\n    \
options = { scale = 0.5 }  # of this scene alone\n    \
[[scenes]]\n    \
name = \"room\"\n    \
synthetic = { scene = \"room\", frames = 80, width = 240, depth_noise = true }\n\n\
The output folder receives:\n    \
report.html        one self-contained page: tables in the form of the paper's I to VI, mean and spread\n                       \
over the seeds, published rows apart with their protocols, paths, error over\n                       \
time, times, class maps, meshes coloured by error\n    \
report.md          its tables\n    \
results.json       every figure of every run with its protocol, and means over the seeds\n    \
results.csv        the same, one line per figure\n    \
runs/              one folder per run: run.toml (its inputs), log.txt, and all that `run` writes\n    \
data/              the built-in recordings\n\n\
Nothing is done twice: finished runs stay, interrupted ones continue, failed ones are tried again, and \
the report is made from those that are there. Each run is one command that can be repeated blindly, \
`mte-slam run --from runs/NAME/run.toml`, so other machines can share the work: --prepare writes \
these files, native/workflows/ has a Snakemake workflow, and --report-only makes the report. Exit \
code 1 when any run failed.\n\n\
Examples:\n    \
mte-slam evaluate built-in\n    \
mte-slam evaluate replica --data ~/data --dry-run\n    \
mte-slam evaluate mine.toml --out out/mine --jobs 2";

/// `evaluate`.
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// File of the suite, or the name of an included one: built-in, replica, scannet, recordings,
    /// tiny.
    #[arg(value_name = "SUITE.toml", value_hint = ValueHint::FilePath)]
    pub suite: PathBuf,
    /// Output folder: empty, absent, or of an earlier start [default: out/NAME].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Folder that the scenes' paths start from [default: $MTE_SLAM_DATA, else the suite's folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub data: Option<PathBuf>,
    /// Runs at a time. More than one shares the cores among them, which lengthens the times of
    /// each [default: 1 on a graphics adapter, else one per 4 cores].
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub jobs: Option<usize>,
    /// Check the suite, print its runs and how far each is, and do nothing.
    #[arg(long, conflicts_with_all = ["report_only", "prepare"])]
    pub dry_run: bool,
    /// Write what the runs need (runs/*/run.toml, data/), print the runs, and run nothing.
    #[arg(long, conflicts_with = "report_only")]
    pub prepare: bool,
    /// Run nothing: make the report from whatever runs are there.
    #[arg(long)]
    pub report_only: bool,
}
