//! The program, a small run of it and a small recording, for the tests.
use serde_json::Value;
use std::{
    ffi::OsStr,
    fmt::Debug,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::OnceLock,
};
use tempfile::TempDir;

pub const FRAMES: usize = 6;

/// A run small enough for a test: coarse field, few rays, few iterations.
pub const TINY: [&str; 30] = [
    "--preset",
    "fast",
    "--engine",
    "cpu",
    "--set",
    "mapping.rays=400",
    "--set",
    "mapping.iterations=4",
    "--set",
    "mapping.first_iterations=60",
    "--set",
    "mapping.final_iterations=2",
    "--set",
    "mapping.semantic_iterations=40",
    "--set",
    "mapping.every=2",
    "--set",
    "sampling.render_stratified=24",
    "--set",
    "sampling.render_surface=8",
    "--set",
    "field.surface_fine_m=0.06",
    "--set",
    "mesh.min_component_triangles=1",
    "--mesh-resolution",
    "0.1",
    "--mesh-views",
    "20",
    "--render-every",
    "4",
];

/// The program in `folder`, without the caller's input and recordings.
pub fn command(folder: &Path, arguments: &[impl AsRef<OsStr>]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mte-slam"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).env_remove("MTE_SLAM_DATA");
    command
}

pub fn mte_slam(folder: &Path, arguments: &[impl AsRef<OsStr>]) -> Output {
    command(folder, arguments).output().expect("the program starts")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

pub fn succeed(folder: &Path, arguments: &[impl AsRef<OsStr> + Debug]) -> Output {
    let output = mte_slam(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    output
}

/// Runs something that must fail with `code` and a message that holds all of `parts`.
pub fn refused(
    folder: &Path,
    arguments: &[impl AsRef<OsStr> + Debug],
    code: i32,
    parts: &[&str],
) -> Output {
    let output = mte_slam(folder, arguments);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
    for part in parts {
        assert!(message.contains(part), "{arguments:?}: no {part:?} in {message:?}");
    }
    assert!(!message.contains("panicked"), "{message}");
    output
}

/// [`refused`], with nothing on standard output and no output folder `out` left behind.
pub fn fail(folder: &Path, arguments: &[&str], code: i32, parts: &[&str]) {
    let output = refused(folder, arguments, code, parts);
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", text(&output.stdout));
    assert!(!folder.join("out").exists(), "{arguments:?} left something behind");
}

pub struct Shared {
    pub folder: TempDir,
    pub json: String,
}

/// One demo run and one written sequence that several tests look at.
pub fn shared() -> &'static Shared {
    static SHARED: OnceLock<Shared> = OnceLock::new();
    SHARED.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let frames = FRAMES.to_string();
        let mut demo = vec!["demo", "--json", "--frames", &frames, "--width", "64"];
        demo.extend(["--seed", "5", "--out", "demo"]);
        demo.extend(TINY);
        let json = text(&succeed(folder.path(), &demo).stdout);
        succeed(folder.path(), &["synth", "room", "--frames", &frames, "--width", "64"]);
        Shared { folder, json }
    })
}

/// A copy of the written sequence, to be spoiled.
pub fn recording() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&shared().folder.path().join("room"), &folder.path().join("room"));
    folder
}

pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

pub fn run_arguments<'a>(extra: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec!["run", "room", "--out", "out"];
    arguments.extend(TINY);
    arguments.extend(extra);
    arguments
}

pub fn read(path: PathBuf) -> String {
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

pub fn json_of(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_slice(&succeed(folder, arguments).stdout).unwrap()
}

/// A JSON file.
pub fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// Labels of every frame changed by `change(pixel, raw id)`, in a folder `name`.
pub fn write_labels(folder: &Path, name: &str, change: impl Fn(u32, u32, u8) -> u16) {
    fs::create_dir_all(folder.join(name)).unwrap();
    for i in 0..FRAMES {
        let file = format!("semantic_class_{i:06}.png");
        let image = image::open(folder.join("room/semantic_class").join(&file)).unwrap();
        let image = image.into_luma8();
        let changed = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_fn(
            image.width(),
            image.height(),
            |x, y| image::Luma([change(x, y, image.get_pixel(x, y).0[0])]),
        );
        changed.save(folder.join(name).join(&file)).unwrap();
    }
}
