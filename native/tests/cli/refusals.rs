//! What cannot be done is refused, with a message that says what to do.
use crate::program::*;
use std::{fs, path::Path};

#[test]
fn wrong_command_lines_are_usage_errors() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    fs::create_dir(f.join("room")).unwrap();
    let demo = |extra: &[&'static str]| -> Vec<&'static str> {
        let mut v =
            vec!["demo", "--frames", "2", "--width", "32", "--engine", "cpu", "--out", "out"];
        v.extend(extra);
        v
    };
    fail(f, &[], 2, &["Usage"]);
    fail(f, &["fly"], 2, &["unrecognized subcommand"]);
    fail(f, &demo(&["--set", "mapping.iteration=3"]), 2, &["mapping.iterations", "Did you mean"]);
    fail(f, &demo(&["--set", "mapping.iterations=many"]), 2, &["found string", "expected integer"]);
    fail(f, &demo(&["--set", "mapping.rays=0"]), 2, &["mapping.rays", "found 0"]);
    fail(f, &demo(&["--set", "mapping"]), 2, &["KEY=VALUE"]);
    fail(f, &demo(&["--set", "tracking.tracker=laser"]), 2, &["tracking.tracker", "laser"]);
    fail(f, &demo(&["--preset", "warp"]), 2, &["found `warp`", "fast, replica, scannet, tum"]);
    fail(f, &demo(&["--config", "none.toml"]), 2, &["none.toml", "cannot be read"]);
    fs::write(f.join("bad.toml"), "[mapping]\nrays = \"x\"\n").unwrap();
    fail(f, &demo(&["--config", "bad.toml"]), 2, &["bad.toml", "mapping.rays", "expected integer"]);
    fs::write(f.join("broken.toml"), "[mapping\n").unwrap();
    fail(f, &demo(&["--config", "broken.toml"]), 2, &["broken.toml", "not TOML"]);
    fail(f, &demo(&["--adapter", "x"]), 2, &["--adapter x", "--engine cpu"]);
    for bad in [["--scale", "0"], ["--scale", "nan"], ["--stride", "0"], ["--frames", "0"]] {
        fail(f, &["run", "room", "--out", "out", bad[0], bad[1]], 2, &[bad[0], "expected"]);
    }
    fail(f, &["mesh", "out", "--resolution", "0"], 2, &["resolution"]);
}

#[test]
fn outputs_that_cannot_be_are_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    fs::write(f.join("file"), "x").unwrap();
    fs::create_dir(f.join("thesis")).unwrap();
    fs::write(f.join("thesis/chapter.tex"), "x").unwrap();
    let demo = |out: &'static str| {
        vec!["demo", "--frames", "2", "--width", "32", "--engine", "cpu", "--out", out]
    };
    fail(f, &demo("file"), 1, &["file", "expected a folder"]);
    fail(f, &demo("file/deeper"), 1, &["file/deeper", "cannot be written", "--out"]);
    fail(f, &demo("thesis"), 1, &["chapter.tex", "--force"]);
    assert_eq!(names(&f.join("thesis")), ["chapter.tex"]);
    assert_eq!(names(f), ["file", "thesis"]);
    fail(f, &["synth", "thesis", "--frames", "2", "--width", "32"], 1, &["thesis", "empty folder"]);
    for command in [vec!["mesh", "thesis"], vec!["render", "thesis", "--frame", "0"]] {
        fail(f, &command, 1, &["checkpoint.safetensors", "cannot be read"]);
    }
}

#[test]
fn an_adapter_that_is_not_there_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["demo", "--frames", "2", "--width", "32", "--out", "out", "--adapter", "No Such Card"];
    fail(folder.path(), &arguments, 1, &["No Such Card", "mte-slam info"]);
}

#[test]
fn recordings_that_are_not_there_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    fail(f, &run_arguments(&[]), 1, &["room"]);
    fs::create_dir(f.join("room")).unwrap();
    fail(f, &run_arguments(&[]), 1, &["room", "no known layout"]);
    fs::write(f.join("room/notes.txt"), "x").unwrap();
    fail(f, &run_arguments(&["--layout", "tum"]), 1, &["room", "rgb.txt"]);
    fail(f, &run_arguments(&["--layout", "paper"]), 2, &["paper", "replica", "tum", "7scenes"]);
    fail(f, &["eval", "nowhere", "room"], 1, &["nowhere"]);
    fail(f, &run_arguments(&["--labels", "segmented"]), 1, &["segmented"]);
}

/// Spoil one file of a good recording, and see the run fail with what is wrong in which file.
fn spoiled(file: &str, change: impl Fn(Vec<u8>) -> Vec<u8>, extra: &[&str], parts: &[&str]) {
    let folder = recording();
    let path = folder.path().join("room").join(file);
    fs::write(&path, change(fs::read(&path).unwrap())).unwrap();
    let mut parts = parts.to_vec();
    parts.push(Path::new(file).file_name().unwrap().to_str().unwrap());
    fail(folder.path(), &run_arguments(extra), 1, &parts);
}

#[test]
fn spoiled_recordings_fail_with_file_and_frame_and_leave_nothing() {
    let half = |mut bytes: Vec<u8>| {
        bytes.truncate(bytes.len() / 2);
        bytes
    };
    spoiled("results/depth000003.png", half, &[], &["frame 3"]);
    spoiled("results/frame000002.png", half, &[], &["frame 2"]);
    spoiled("results/depth000001.png", |_| Vec::new(), &[], &["frame 1"]);
    let two_lines = |bytes: Vec<u8>| {
        text(&bytes).lines().take(2).map(|l| format!("{l}\n")).collect::<String>().into_bytes()
    };
    spoiled("traj.txt", two_lines, &[], &["found 2", "6"]);
    let other_size = |bytes: Vec<u8>| {
        let image = image::load_from_memory(&bytes).unwrap().crop_imm(0, 0, 32, 32);
        let mut png = std::io::Cursor::new(Vec::new());
        image.write_to(&mut png, image::ImageFormat::Png).unwrap();
        png.into_inner()
    };
    spoiled("results/depth000002.png", other_size, &[], &["32x32", "64x48", "frame 2"]);
    spoiled("cam_params.json", |_| b"{".to_vec(), &[], &["cam_params.json"]);
    let folder = recording();
    fs::remove_file(folder.path().join("room/results/depth000004.png")).unwrap();
    // Left out with a note, unless that is asked for.
    let strict = run_arguments(&["--require-images"]);
    fail(folder.path(), &strict, 1, &["depth000004.png", "no such file", "frame 4"]);
    for (extra, part) in [(["--order", "sideways"], "time, file"), (["--max-depth", "0"], "metres")]
    {
        fail(folder.path(), &run_arguments(&extra), 2, &[part]);
    }
}

#[test]
fn a_true_mesh_that_is_none_is_an_error() {
    spoiled("mesh.ply", |_| b"not a mesh".to_vec(), &[], &["mesh.ply"]);
    let folder = recording();
    fail(folder.path(), &run_arguments(&["--mesh", "none.ply"]), 1, &["none.ply"]);
}
