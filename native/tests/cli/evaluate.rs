//! Suites as people run them: results, nothing done twice, runs that are killed or fail, bad files.
use crate::program::*;
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Output, Stdio},
    time::{Duration, Instant, SystemTime},
};

/// Two scenes, two seeds, runs of a second or two.
const SUITE: &str = r#"
title = "Two scenes & two seeds"
seeds = [1, 2]
presets = ["fast"]

[options]
engine = "cpu"
render_every = 3
mesh_resolution = 0.1
mesh_views = 20
checkpoint_every = 1
set = [
    "mapping.rays=300", "mapping.iterations=4", "mapping.first_iterations=80", "mapping.final_iterations=2",
    "mapping.semantic_iterations=20", "mapping.every=2", "field.surface_fine_m=0.06",
    "sampling.render_stratified=24", "sampling.render_surface=8", "mesh.min_component_triangles=1",
]

[[scenes]]
name = "room"
synthetic = { scene = "room", frames = 6, width = 64 }

[[scenes]]
name = "office"
synthetic = { scene = "office", frames = 6, width = 64, depth_noise = true }
"#;

const RUNS: [&str; 4] = [
    "room.fast.base.seed1",
    "office.fast.base.seed1",
    "room.fast.base.seed2",
    "office.fast.base.seed2",
];

fn said(output: &Output) -> String {
    text(&output.stderr)
}

/// A folder with a suite in it.
fn suite(content: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("suite.toml"), content).unwrap();
    folder
}

/// Every file of a folder with the time it was written at.
fn times(folder: &Path) -> Vec<(PathBuf, SystemTime)> {
    let mut all = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let entry = entry.unwrap();
            if entry.path().is_dir() {
                folders.push(entry.path());
            } else {
                all.push((entry.path(), entry.metadata().unwrap().modified().unwrap()));
            }
        }
    }
    all.sort();
    all
}

#[test]
fn a_suite_measures_reports_and_does_nothing_twice() {
    let folder = suite(SUITE);
    let folder = folder.path();
    let plan = succeed(folder, &["evaluate", "suite.toml", "--out", "out", "--dry-run"]);
    let text = String::from_utf8_lossy(&plan.stdout).into_owned();
    assert!(RUNS.iter().all(|r| text.contains(&format!("{r}  to do"))), "{text}");
    assert!(!folder.join("out").exists(), "a dry run writes nothing");

    let first = succeed(folder, &["evaluate", "suite.toml", "--out", "out", "--jobs", "2"]);
    let progress = said(&first);
    assert!(progress.contains("4/4 ") && progress.contains("left 0:00"), "{progress}");
    let out = folder.join("out");
    let results = json(&out.join("results.json"));
    let runs = results["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    for run in runs {
        assert_eq!(run["state"], "finished");
        assert_eq!(run["engine"]["kind"], "cpu");
        assert_eq!(run["program"], concat!("mte-slam ", env!("CARGO_PKG_VERSION")));
        assert!(run["config_hash"].as_str().unwrap().len() == 16);
        let ate = &run["figures"]["trajectory.aligned_cm.rmse"];
        assert!(ate["value"].as_f64().unwrap() >= 0.0);
        assert!(ate["protocol"].as_str().unwrap().starts_with("ATE"));
        assert!(run["figures"]["semantics.miou_percent"]["value"].is_number());
        assert!(run["figures"]["mesh.point_to_surface.accuracy_cm"]["value"].is_number());
        let folder = out.join("runs").join(run["name"].as_str().unwrap());
        for file in ["run.toml", "log.txt", "metrics.json", "mesh.ply", "trajectory.svg"] {
            assert!(folder.join(file).is_file(), "{file}");
        }
        // The same figures as the run's own.
        let metrics = json(&folder.join("metrics.json"));
        assert_eq!(metrics["trajectory"]["aligned_cm"]["rmse"], ate["value"]);
    }
    // Means over the seeds.
    let value = |k: usize| {
        let figure = &runs[k]["figures"]["trajectory.aligned_cm.rmse"];
        figure["value"].as_f64().unwrap()
    };
    let room = &results["summary"][0];
    assert_eq!(
        (room["scene"].as_str(), &room["seeds"]),
        (Some("room"), &serde_json::json!([1, 2]))
    );
    let over = &room["figures"]["trajectory.aligned_cm.rmse"];
    let (a, b) = (value(0), value(2));
    assert!((over["mean"].as_f64().unwrap() - 0.5 * (a + b)).abs() < 1e-9);
    let spread = (a - b).abs() / 2f64.sqrt();
    assert!((over["standard_deviation"].as_f64().unwrap() - spread).abs() < 1e-9);

    let csv = fs::read_to_string(out.join("results.csv")).unwrap();
    let lines = csv.lines().filter(|l| l.contains(",trajectory.aligned_cm.rmse,")).count();
    assert_eq!(lines, 4);
    assert!(csv.lines().next().is_some_and(|head| head.ends_with(",protocol,protocol_id")));
    assert_eq!(csv.lines().filter(|l| l.ends_with(",ate/rigid@1")).count() % 4, 0);
    assert!(csv.contains(",miou/all-images@1+renders/estimated-poses@1+labels/scored"), "{csv}");

    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for part in [
        "Two scenes &amp; two seeds",
        "form of Tables I and II",
        "form of Table III",
        "form of Table IV",
        "form of Table V",
        "form of Table VI",
        "ATE RMSE, aligned (cm); measured here, mean ± standard deviation over 2 seeds",
        "prefers-color-scheme: dark",
        "4 runs finished",
        "camera paths, aligned to the truth",
        "coloured by its distance to the true one",
        "data:image/png;base64,",
        "classes rendered at the estimated pose of frame 3",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for part in ["http:", "https:", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(part), "{part}");
    }
    assert!(page.matches("src=\"").count() == page.matches("src=\"data:image/").count());
    let markdown = fs::read_to_string(out.join("report.md")).unwrap();
    assert!(markdown.contains("| fast") && markdown.contains("](runs/room.fast.base.seed1/"));

    // A second start changes no file at all.
    let before = times(&out);
    let second = succeed(folder, &["evaluate", "suite.toml", "--out", "out"]);
    assert!(said(&second).contains("all 4 runs finished before"), "{}", said(&second));
    assert_eq!(times(&out), before);
    // Nor does the command of a single run.
    succeed(folder, &["run", "--from", "out/runs/room.fast.base.seed1/run.toml"]);
    assert_eq!(times(&out), before);

    // Other inputs are not mixed in.
    fs::write(folder.join("other.toml"), SUITE.replace("render_every = 3", "render_every = 2"))
        .unwrap();
    let parts = ["run.toml", "render_every: found 3, expected 2", "--out"];
    refused(folder, &["evaluate", "other.toml", "--out", "out"], 1, &parts);
    assert_eq!(times(&out), before);

    // A report of what is there, without one of the runs.
    fs::remove_dir_all(out.join("runs/office.fast.base.seed2")).unwrap();
    succeed(folder, &["evaluate", "suite.toml", "--out", "out", "--report-only"]);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("3 of 4 runs finished") && page.contains("(n = 1)"), "a missing run");
    assert!(page.contains("office.fast.base.seed2: missing"));
    assert!(!out.join("runs/office.fast.base.seed2").exists());

    // Beside published figures, in tables of their own.
    let text = format!("benchmark = \"replica\"\n{}", SUITE);
    fs::write(folder.join("suite.toml"), text).unwrap();
    succeed(folder, &["evaluate", "suite.toml", "--out", "out", "--report-only"]);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for part in [
        "Published: Semantic segmentation mIoU (%) on Replica",
        "Source: Table IV of the MTE-SLAM paper",
        "<td>88.85</td>",
        "learnt from the labels that are scored against",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("Table I of the MTE-SLAM paper"), "that is ScanNet's");
}

/// The suite with one scene and seed, and runs that take some seconds.
fn slow() -> String {
    let text = SUITE.replace("seeds = [1, 2]", "seeds = [1]").replace("frames = 6", "frames = 12");
    let text = text.replace("mapping.semantic_iterations=20", "mapping.semantic_iterations=800");
    let text = text.replace("mesh_resolution = 0.1", "no_mesh = true");
    text.split("[[scenes]]\nname = \"office\"").next().unwrap().to_owned()
}

fn wait_for(what: &str, there: impl Fn() -> bool) {
    let begin = Instant::now();
    while !there() {
        assert!(begin.elapsed() < Duration::from_secs(120), "waited too long for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Start a suite, and kill it as soon as its run has left a checkpoint.
fn kill_in_the_middle(folder: &Path) {
    let arguments = ["evaluate", "suite.toml", "--out", "out"];
    let mut parent = command(folder, &arguments).stderr(Stdio::null()).spawn().unwrap();
    let saved = folder.join("out/runs/room.fast.base.seed1/.resume/checkpoint.safetensors");
    let ended = || folder.join("out/report.html").exists();
    wait_for("a checkpoint", || saved.is_file() || ended());
    // Meanwhile nobody else may work there.
    refused(folder, &arguments, 1, &["another start of a suite at work"]);
    parent.kill().unwrap();
    parent.wait().unwrap();
}

#[test]
fn a_suite_that_was_killed_goes_on_to_the_same_files() {
    let whole = suite(&slow());
    succeed(whole.path(), &["evaluate", "suite.toml", "--out", "out"]);
    let folder = suite(&slow());
    let folder = folder.path();
    kill_in_the_middle(folder);
    let of_run = folder.join("out/runs/room.fast.base.seed1");
    assert!(!of_run.join("metrics.json").exists(), "it was killed before the end");
    // The run ends by itself when its parent is gone: its log grows no more.
    let log = || fs::read_to_string(of_run.join("log.txt")).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let after_kill = log();
    let plan = succeed(folder, &["evaluate", "suite.toml", "--out", "out", "--dry-run"]);
    let text = String::from_utf8_lossy(&plan.stdout).into_owned();
    assert!(text.contains("room.fast.base.seed1  interrupted"), "{text}");
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(log(), after_kill, "the run outlived the suite");

    succeed(folder, &["evaluate", "suite.toml", "--out", "out"]);
    assert!(log().contains("resumed after"), "{}", log());
    for file in ["trajectory.txt", "renders/000003.color.png", "checkpoint.safetensors"] {
        let path = Path::new("out/runs/room.fast.base.seed1").join(file);
        let read = |root: &Path| fs::read(root.join(&path)).unwrap();
        assert!(read(folder) == read(whole.path()), "{file} differs");
    }
}

#[test]
fn a_failed_run_is_reported_and_the_others_are_done() {
    // A recording of which one frame is no picture.
    let text = SUITE.replace("seeds = [1, 2]", "seeds = [1]");
    let text = text.replace("mesh_resolution = 0.1", "no_mesh = true");
    let text = text.replace(
        "synthetic = { scene = \"office\", frames = 6, width = 64, depth_noise = true }",
        "path = \"broken\"",
    );
    let folder = suite(&text);
    let folder = folder.path();
    succeed(folder, &["synth", "broken", "--frames", "4", "--width", "64"]);
    let frame = folder.join("broken/results/depth000002.png");
    let good = fs::read(&frame).unwrap();
    fs::write(&frame, b"no picture").unwrap();
    let arguments = ["evaluate", "suite.toml", "--out", "out"];
    let name = "office.fast.base.seed1";
    let parts = ["1 of 2 runs failed", name, "depth000002.png"];
    refused(folder, &arguments, 1, &parts);
    let out = folder.join("out");
    let results = json(&out.join("results.json"));
    let states: Vec<&str> =
        results["runs"].as_array().unwrap().iter().map(|r| r["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["finished", "failed"]);
    assert!(results["runs"][1]["reason"].as_str().unwrap().contains("depth000002.png"));
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("Runs without results") && page.contains("depth000002.png"));
    // Mended, it is tried again, and the other is left alone.
    let log = out.join("runs/room.fast.base.seed1/log.txt");
    let before = fs::metadata(&log).unwrap().modified().unwrap();
    fs::write(&frame, good).unwrap();
    succeed(folder, &arguments);
    assert_eq!(fs::metadata(&log).unwrap().modified().unwrap(), before);
    let results = json(&out.join("results.json"));
    assert_eq!(results["runs"][1]["state"], "finished");
    assert!(!out.join("runs").join(name).join("failed.txt").exists());
}

#[test]
fn bad_suites_say_what_is_wrong() {
    let bad = |from: &str, to: &str, parts: &[&str]| {
        let text = SUITE.replace(from, to);
        assert_ne!(text, SUITE, "{from}");
        let folder = suite(&text);
        let mut all = vec!["suite.toml"];
        all.extend(parts);
        refused(folder.path(), &["evaluate", "suite.toml", "--out", "out"], 2, &all);
        assert!(!folder.path().join("out").exists(), "nothing is begun");
    };
    bad("title", "titel", &["`titel`", "`title`", "line 2"]);
    bad("[1, 2]", "[2, 2]", &["seeds", "found 2 twice"]);
    bad("\"fast\"", "\"fats\"", &["presets", "`fats`", "fast"]);
    bad("render_every = 3", "render_evry = 3", &["options", "`render_evry`", "`render_every`"]);
    bad("engine = \"cpu\"", "engine = \"tpu\"", &["'tpu'", "auto, gpu, cpu"]);
    bad("mapping.rays=300", "mapping.raise=4", &["room.fast.base.seed1", "`mapping.rays`"]);
    bad("scene = \"room\"", "scene = \"barn\"", &["`barn`", "`room`"]);
    bad(
        "synthetic = { scene = \"room\", frames = 6, width = 64 }",
        "path = \"nowhere/room\"",
        &["found no nowhere/room below .", "the suite's folder", "--data"],
    );
    let folder = suite(SUITE);
    refused(folder.path(), &["evaluate", "none.toml"], 2, &["none.toml", "built-in, recordings"]);
    let parts = ["found no finished run"];
    refused(folder.path(), &["evaluate", "suite.toml", "--report-only", "--out", "out"], 2, &parts);
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/thesis.tex"), "x").unwrap();
    refused(folder.path(), &["evaluate", "suite.toml", "--out", "mine"], 1, &["thesis.tex"]);
}

#[test]
fn suites_with_data_fail_early_with_the_way_to_get_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::create_dir_all(folder.join("data/Replica/room0")).unwrap();
    let parts = [
        "found no Replica/room0_mesh.ply, Replica/room1,",
        "below data (by --data)",
        "download_replica.sh",
    ];
    refused(folder, &["evaluate", "replica", "--data", "data", "--out", "out"], 2, &parts);
    let output = command(folder, &["evaluate", "scannet", "--out", "out"])
        .env("MTE_SLAM_DATA", "elsewhere")
        .output()
        .unwrap();
    let message = said(&output);
    assert_eq!(output.status.code(), Some(2));
    for part in ["scene0207_00.sens", "elsewhere (by MTE_SLAM_DATA)", "download-scannet.py"] {
        assert!(message.contains(part), "{part} in {message}");
    }
    assert!(!folder.join("out").exists());
    // The plan is shown all the same: 8 scenes of 5 seeds.
    let output = mte_slam(folder, &["evaluate", "replica", "--dry-run", "--json"]);
    let plan: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(plan["runs"].as_array().unwrap().len(), 40);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_run_from_a_file_is_one_command() {
    let folder = suite(&SUITE.replace("mesh_resolution = 0.1", "no_mesh = true"));
    let folder = folder.path();
    succeed(folder, &["evaluate", "suite.toml", "--out", "out", "--prepare"]);
    let file = "out/runs/office.fast.base.seed2/run.toml";
    assert!(folder.join(file).is_file() && !folder.join("out/report.html").exists());
    refused(folder, &["run", "--from", file, "--seed", "3"], 2, &["found other arguments"]);
    refused(folder, &["run", "--from", "none.toml"], 2, &["none.toml", "cannot be read"]);
    succeed(folder, &["run", "--from", file]);
    let metrics = json(&folder.join(file).with_file_name("metrics.json"));
    assert_eq!(metrics["configuration"]["seed"], 2);
    assert_eq!(metrics["sequence"]["frames"], 6);
    let again = succeed(folder, &["run", "--from", file]);
    assert!(said(&again).contains("finished before, nothing to do"));
    let text = fs::read_to_string(folder.join(file)).unwrap();
    fs::write(folder.join("bad.toml"), text + "speed = 3\n").unwrap();
    refused(
        folder,
        &["run", "--from", "bad.toml"],
        2,
        &["bad.toml", "`speed`", "expected an option"],
    );
    // A suite finds the run that was made in this way.
    let plan = succeed(folder, &["evaluate", "suite.toml", "--out", "out", "--dry-run"]);
    let text = String::from_utf8_lossy(&plan.stdout).into_owned();
    assert!(text.contains("office.fast.base.seed2  finished"), "{text}");
    assert!(text.contains("4 runs, 1 finished"), "{text}");
}
