//! The program as people run it: exit codes, messages, and the files of an output folder.
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};
use tempfile::TempDir;

const FRAMES: usize = 6;

/// A run small enough for a test: coarse field, few rays, few iterations.
const TINY: [&str; 30] = [
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

fn mte_slam(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mte-slam"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn succeed(folder: &Path, arguments: &[&str]) -> Output {
    let output = mte_slam(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    output
}

/// Run something that must fail with `code` and a message that holds all of `parts`, and must
/// leave no output folder `out`.
fn fail(folder: &Path, arguments: &[&str], code: i32, parts: &[&str]) {
    let output = mte_slam(folder, arguments);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
    for part in parts {
        assert!(message.contains(part), "{arguments:?}: no {part:?} in {message:?}");
    }
    assert!(!message.contains("panicked"), "{message}");
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", text(&output.stdout));
    assert!(!folder.join("out").exists(), "{arguments:?} left something behind");
}

struct Shared {
    folder: TempDir,
    json: String,
}

/// One demo run and one written sequence that several tests look at.
fn shared() -> &'static Shared {
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
fn recording() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&shared().folder.path().join("room"), &folder.path().join("room"));
    folder
}

fn copy(from: &Path, to: &Path) {
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

fn run_arguments<'a>(extra: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec!["run", "room", "--out", "out"];
    arguments.extend(TINY);
    arguments.extend(extra);
    arguments
}

fn read(path: PathBuf) -> String {
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn demo_writes_every_file_and_they_can_be_read() {
    let out = shared().folder.path().join("demo");
    assert_eq!(
        names(&out),
        [
            "anchors.svg",
            "checkpoint.safetensors",
            "classes.csv",
            "config.toml",
            "confusion.png",
            "legend.png",
            "mesh.glb",
            "mesh.ply",
            "mesh_semantic.glb",
            "mesh_semantic.ply",
            "metrics.json",
            "renders",
            "timings.csv",
            "trajectory.svg",
            "trajectory.txt",
            "trajectory_gt.txt",
        ]
    );
    for file in ["trajectory.txt", "trajectory_gt.txt"] {
        let text = read(out.join(file));
        let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
        assert_eq!(lines.len(), FRAMES);
        for (i, line) in lines.iter().enumerate() {
            let numbers: Vec<f64> = line.split(' ').map(|n| n.parse().unwrap()).collect();
            assert_eq!(numbers.len(), 8, "{line}");
            assert!((numbers[0] - i as f64 / 30.0).abs() < 1e-12, "{line}");
            let norm: f64 = numbers[4..].iter().map(|q| q * q).sum();
            assert!((norm - 1.0).abs() < 1e-9, "{line}");
        }
    }
    let timings = read(out.join("timings.csv"));
    assert_eq!(timings.lines().count(), FRAMES + 1);
    assert!(timings.lines().nth(1).unwrap().ends_with(",first"), "{timings}");
    let svg = read(out.join("trajectory.svg"));
    assert!(svg.starts_with("<svg") && svg.contains("ATE RMSE") && svg.contains("[m]"));
    for file in ["mesh.ply", "mesh_semantic.ply"] {
        let ply = fs::read(out.join(file)).unwrap();
        assert!(ply.starts_with(b"ply\nformat binary_little_endian 1.0\n"), "{file}");
    }
    for file in ["mesh.glb", "mesh_semantic.glb"] {
        assert!(fs::read(out.join(file)).unwrap().starts_with(b"glTF"), "{file}");
    }
    let csv = read(out.join("classes.csv"));
    let json: Value = serde_json::from_str(&read(out.join("metrics.json"))).unwrap();
    let classes = json["semantics"]["classes"].as_array().unwrap();
    assert_eq!(csv.lines().count(), classes.len() + 1);
    assert!(csv.starts_with("id,name,pixels,iou_percent,"), "{csv}");
    for file in ["legend.png", "confusion.png"] {
        let image = image::open(out.join(file)).unwrap();
        assert!(image.width() > 200 && image.height() > 100, "{file}");
    }
    let mut pictures = Vec::new();
    for frame in ["000000", "000004"] {
        for kind in ["class", "class_color", "color", "depth", "sheet"] {
            let name = format!("{frame}.{kind}.png");
            let image = image::open(out.join("renders").join(&name)).unwrap();
            if kind != "sheet" {
                assert_eq!((image.width(), image.height()), (64, 48), "{name}");
                let deep = image.color() == image::ColorType::L16;
                assert_eq!(deep, !kind.ends_with("color"), "{name}");
            }
            pictures.push(name);
        }
    }
    assert_eq!(names(&out.join("renders")), pictures);
}

#[test]
fn json_goes_to_stdout_alone_and_equals_the_file() {
    let shared = shared();
    assert_eq!(shared.json, read(shared.folder.path().join("demo/metrics.json")));
    let json: Value = serde_json::from_str(&shared.json).unwrap();
    for section in ["trajectory", "depth", "color", "semantics", "mesh", "time", "memory"] {
        assert!(json[section]["protocol"].is_string(), "{section}: {json:#}");
    }
    assert!(json["trajectory"]["aligned_cm"]["rmse"].as_f64().unwrap().is_finite());
    assert!(json["memory"]["device_bytes"].as_u64().unwrap() > 0);
    assert_eq!(json["engine"]["kind"], "cpu");
    assert_eq!(json["configuration"]["seed"], 5);
    assert!(json["lost_frames"].is_array());
}

#[test]
fn the_written_configuration_repeats_the_run_byte_for_byte() {
    let shared = shared().folder.path();
    let folder = tempfile::tempdir().unwrap();
    let config = shared.join("demo/config.toml");
    let frames = FRAMES.to_string();
    let mut again = vec!["demo", "-q", "--frames", &frames, "--width", "64", "--engine", "cpu"];
    again.extend(["--config", config.to_str().unwrap(), "--out", "again"]);
    again.extend(["--no-mesh", "--render-every", "0"]);
    let output = succeed(folder.path(), &again);
    assert!(output.stdout.is_empty() && output.stderr.is_empty(), "-q is quiet");
    for file in ["trajectory.txt", "checkpoint.safetensors"] {
        let (a, b) = (shared.join("demo").join(file), folder.path().join("again").join(file));
        assert!(fs::read(a).unwrap() == fs::read(b).unwrap(), "{file} differs");
    }
    let json: Value =
        serde_json::from_str(&read(folder.path().join("again/metrics.json"))).unwrap();
    assert_eq!(json["absent"]["mesh"], "--no-mesh was given");
    assert_eq!(json["absent"]["depth"], "no frame was rendered");
}

#[test]
fn eval_mesh_and_render_work_from_the_files_of_a_run() {
    let folder = recording();
    // An output folder of an earlier run is used again.
    for _ in 0..2 {
        let mut arguments = vec!["run", "room", "--out", "demo", "-q"];
        arguments.extend(TINY);
        succeed(folder.path(), &arguments);
    }
    let demo = folder.path().join("demo");
    let eval = text(&succeed(folder.path(), &["eval", "demo", "room", "--json"]).stdout);
    let (eval, run): (Value, Value) = (
        serde_json::from_str(&eval).unwrap(),
        serde_json::from_str(&read(demo.join("metrics.json"))).unwrap(),
    );
    let close = |path: &[&str], tolerance: f64| {
        let get = |v: &Value| path.iter().fold(v.clone(), |v, k| v[k].clone()).as_f64().unwrap();
        let (a, b) = (get(&eval), get(&run));
        assert!((a - b).abs() <= tolerance, "{path:?}: {a} from files, {b} in the run");
    };
    close(&["trajectory", "aligned_cm", "rmse"], 1e-4);
    // Depth pictures hold whole millimetres.
    close(&["depth", "l1_cm"], 0.1);
    close(&["color", "mean_of_psnr_db"], 1e-6);
    close(&["semantics", "miou_percent"], 1e-6);
    close(&["mesh", "point_to_surface", "accuracy_cm"], 0.05);
    assert!(demo.join("eval.json").is_file());

    let before = fs::read(demo.join("mesh.ply")).unwrap();
    succeed(folder.path(), &["mesh", "demo", "--resolution", "0.08", "--engine", "cpu"]);
    assert!(fs::read(demo.join("mesh.ply")).unwrap().len() > before.len());
    let rendered = demo.join("renders/000004.color.png");
    let first = fs::read(&rendered).unwrap();
    succeed(folder.path(), &["render", "demo", "--frame", "4", "--engine", "cpu"]);
    assert!(fs::read(&rendered).unwrap() == first, "the restored map renders the same");
    succeed(folder.path(), &["render", "demo", "--frame", "5", "--engine", "cpu"]);
    assert!(demo.join("renders/000005.depth.png").is_file());
    // The same pose given as numbers shows the same, and a path is a folder of views.
    let trajectory = read(demo.join("trajectory.txt"));
    let pose = trajectory.lines().nth(6).unwrap().split_once(' ').unwrap().1;
    succeed(folder.path(), &["render", "demo", "--pose", pose, "--engine", "cpu"]);
    let frame = image::open(demo.join("renders/000005.class.png")).unwrap().into_luma16();
    let view = image::open(demo.join("views/pose.class.png")).unwrap().into_luma16();
    let differ = frame.pixels().zip(view.pixels()).filter(|(a, b)| a != b).count();
    assert!(differ < 10, "{differ} pixels differ");
    fs::write(folder.path().join("tour.txt"), &trajectory).unwrap();
    succeed(folder.path(), &["render", "demo", "--path", "tour.txt", "--engine", "cpu", "-q"]);
    for kind in ["class", "class_color", "color", "depth"] {
        assert!(demo.join(format!("views/000005.{kind}.png")).is_file(), "{kind}");
    }
    fs::write(folder.path().join("tour.txt"), "0 1 2\n").unwrap();
    let render =
        |extra: [&'static str; 2]| ["render", "demo", "--engine", "cpu", extra[0], extra[1]];
    fail(folder.path(), &render(["--path", "tour.txt"]), 1, &["tour.txt line 1", "8"]);
    fs::write(folder.path().join("tour.txt"), "# nothing\n").unwrap();
    fail(folder.path(), &render(["--path", "tour.txt"]), 1, &["tour.txt", "no poses"]);
    fail(folder.path(), &render(["--pose", "1 2 3 0 0 0 2"]), 2, &["--pose", "length 2"]);
    fail(folder.path(), &render(["--pose", "1 2 3"]), 2, &["--pose", "3 numbers", "7 numbers"]);
    fail(folder.path(), &render(["--pose", "1 2 3 0 0 nan 1"]), 2, &["--pose", "length NaN"]);
    fail(folder.path(), &["render", "demo"], 2, &["--frame", "--pose", "--path"]);
    let range: [&str; 2] = ["found 77", "6 frames"];
    fail(folder.path(), &["render", "demo", "--frame", "77", "--engine", "cpu"], 1, &range);
}

/// Labels of every frame changed by `change(pixel, raw id)`, in a folder `name`.
fn write_labels(folder: &Path, name: &str, change: impl Fn(u32, u32, u8) -> u16) {
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

fn json_of(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_slice(&succeed(folder, arguments).stdout).unwrap()
}

#[test]
fn labels_may_be_scored_against_others() {
    let folder = recording();
    let f = folder.path();
    // Three of four columns are right, the fourth is of one class.
    let known = image::open(f.join("room/semantic_class/semantic_class_000000.png")).unwrap();
    let known = u16::from(known.into_luma8().get_pixel(0, 0).0[0]);
    write_labels(f, "noisy", |x, _, id| if x % 4 == 3 { known } else { u16::from(id) });
    let json = json_of(f, &run_arguments(&["--json", "--no-mesh", "--labels", "noisy"]));
    assert_eq!(json["semantics"]["truth"], "dataset");
    assert_eq!(json["sequence"]["truth_labels"], "dataset");
    let input = &json["input_labels"];
    let accuracy = input["pixel_accuracy_percent"].as_f64().unwrap();
    assert!((75.0..90.0).contains(&accuracy), "{accuracy}");
    assert!(input["boundary"]["iou_percent"].as_f64().unwrap() < accuracy);
    assert_eq!(input["images"], json["semantics"]["images"]);
    assert!(json["semantics"]["classes"][0]["id"].is_u64());
    let eval = json_of(f, &["eval", "out", "room", "--json"]);
    assert_eq!(eval["input_labels"], *input, "the run's labels are found again");
    assert_eq!(eval["semantics"]["miou_percent"], json["semantics"]["miou_percent"]);
    // Against themselves, as before.
    let eval = json_of(f, &["eval", "out", "room", "--json", "--truth-labels", "noisy"]);
    assert_eq!((&eval["semantics"]["truth"], eval.get("input_labels")), (&"noisy".into(), None));
    assert_ne!(eval["semantics"]["miou_percent"], json["semantics"]["miou_percent"]);
    let eval = json_of(f, &["eval", "out", "room", "--json", "--truth-labels", "none"]);
    assert_eq!(eval["absent"]["semantics"], "--truth-labels none was given");
    // Where the run's labels have gone, the map's classes can still be scored.
    fs::remove_dir_all(f.join("noisy")).unwrap();
    let eval = json_of(f, &["eval", "out", "room", "--json"]);
    assert_eq!(eval["semantics"]["miou_percent"], json["semantics"]["miou_percent"]);
    assert!(eval.get("input_labels").is_none());

    // Without labels of its own a recording is scored against what it was given.
    write_labels(f, "given", |_, _, id| u16::from(id));
    fs::remove_dir_all(f.join("room/semantic_class")).unwrap();
    let arguments = ["--json", "--no-mesh", "--force", "--labels", "given"];
    let json = json_of(f, &run_arguments(&arguments));
    assert_eq!((&json["semantics"]["truth"], json.get("input_labels")), (&"given".into(), None));
    fs::remove_dir_all(f.join("out")).unwrap();
    let asked = ["--labels", "given", "--truth-labels", "dataset"];
    fail(f, &run_arguments(&asked), 2, &["--truth-labels dataset", "no label images"]);
}

#[test]
fn labels_without_any_class_leave_geometry_and_colour() {
    let folder = recording();
    let f = folder.path();
    write_labels(f, "blank", |_, _, _| 9999);
    let blank = ["--json", "--labels", "blank", "--unlabelled", "9999"];
    let json = json_of(f, &run_arguments(&blank));
    let reason = json["absent"]["semantics"].as_str().unwrap();
    assert!(reason.contains("no pixel of any label image has a class"), "{reason}");
    let warnings = json["warnings"].to_string();
    assert!(warnings.contains("6 label images has a class: geometry and colour"), "{warnings}");
    assert!(json["depth"]["l1_cm"].as_f64().unwrap().is_finite());
    assert!(f.join("out/mesh.ply").is_file() && !f.join("out/mesh_semantic.ply").exists());
    assert!(!f.join("out/renders/000000.class.png").exists());
    // Nor do mesh and views of its checkpoint show classes.
    succeed(f, &["mesh", "out", "--resolution", "0.1", "--engine", "cpu"]);
    assert!(!f.join("out/mesh_semantic.ply").exists());
    succeed(f, &["render", "out", "--frame", "1", "--engine", "cpu"]);
    assert!(f.join("out/renders/000001.color.png").is_file());
    assert!(!f.join("out/renders/000001.class.png").exists());
    fs::remove_dir_all(f.join("out")).unwrap();

    // The same ids without saying that they mean nothing: the class list is another's.
    let none = ["none of the ids in the label images (9999)", "classes.json"];
    fail(f, &run_arguments(&["--labels", "blank"]), 1, &none);
    let none = ["none of the ids in the label images (9999)", "nyu40"];
    fail(f, &run_arguments(&["--labels", "blank", "--classes", "nyu40"]), 1, &none);
    let no_list = ["--classes nyu41", "nyu40, replica, or a readable file"];
    fail(f, &run_arguments(&["--classes", "nyu41"]), 2, &no_list);
    fs::write(f.join("list.json"), "{\"1\": {\"name\": 7}}").unwrap();
    let bad = ["list.json", "class 1: name"];
    fail(f, &run_arguments(&["--classes", "list.json"]), 1, &bad);
}

/// Feature maps change what the map learns; those that do not fit are named, with the frame.
#[test]
fn feature_maps_of_another_model_are_used_and_checked() {
    let folder = recording();
    let f = folder.path();
    let maps = f.join("maps");
    fs::create_dir(&maps).unwrap();
    let npy = |dtype: &str, channels: usize, scale: f32| -> Vec<u8> {
        let header = format!(
            "{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({channels}, 3, 4), }}"
        );
        let header = format!("{header:<117}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        let value = |i: usize| scale * (i as f32 * 0.7).sin();
        bytes.extend((0..channels * 12).flat_map(|i| value(i).to_le_bytes()));
        bytes
    };
    for i in 0..6 {
        fs::write(maps.join(format!("{i:06}.npy")), npy("<f4", 7, 1.0 + i as f32)).unwrap();
    }
    let run = |extra: &[&str]| {
        let mut all = vec!["--json", "--set", "fusion.final_weight=1"];
        all.extend(["--set", "mapping.semantic_iterations=8"]);
        all.extend(extra);
        let mut arguments = run_arguments(&[]);
        arguments.extend(all);
        let json = json_of(f, &arguments);
        succeed(f, &["render", "out", "--frame", "0", "--engine", "cpu"]);
        fs::remove_dir_all(f.join("out")).unwrap();
        json["semantics"]["miou_percent"].as_f64().unwrap()
    };
    let (with, without) = (run(&["--features", "maps"]), run(&[]));
    assert_ne!(with, without);
    for (file, bytes, parts) in [
        ("000002.npy", npy("<f4", 6, 1.0), ["(frame 2)", "found 6, expected 7"]),
        ("000001.npy", npy("<f8", 7, 1.0), ["(frame 1)", "found <f8"]),
    ] {
        let good = fs::read(maps.join(file)).unwrap();
        fs::write(maps.join(file), bytes).unwrap();
        fail(f, &run_arguments(&["--features", "maps"]), 1, &[file, parts[0], parts[1]]);
        fs::write(maps.join(file), good).unwrap();
    }
    fs::remove_file(maps.join("000003.npy")).unwrap();
    let missing = ["000003.npy", "no such file", "frame 3"];
    fail(f, &run_arguments(&["--features", "maps"]), 1, &missing);
    fail(f, &run_arguments(&["--features", "nowhere"]), 1, &["nowhere"]);
}

#[test]
fn an_ablation_compares_rows_over_seeds_and_resumes() {
    let folder = recording();
    let f = folder.path();
    let known = image::open(f.join("room/semantic_class/semantic_class_000000.png")).unwrap();
    let known = u16::from(known.into_luma8().get_pixel(0, 0).0[0]);
    write_labels(f, "noisy", |x, _, id| if x % 4 == 3 { known } else { u16::from(id) });
    let arguments = |extra: &[&'static str]| {
        let mut all = vec!["ablate", "room", "--out", "out", "--seeds", "2"];
        let tiny = TINY.iter().position(|a| *a == "--mesh-resolution").unwrap();
        all.extend(&TINY[..tiny]);
        all.extend(["--set", "mapping.semantic_iterations=8", "--set", "mapping.rays=200"]);
        // Few samples: the row with a perceptron on each of them takes most of the time.
        all.extend(["--set", "sampling.stratified=8"]);
        // So strong that a few iterations show which module is on.
        all.extend(["--set", "fusion.first_steps=8", "--set", "fusion.final_weight=1"]);
        all.extend(["--set", "suppressor.final_weight=1"]);
        all.extend(extra);
        all
    };
    // What cannot be scored, or is not ablate's to take, is refused before any work.
    let none = ["ablate needs labels", "--labels none"];
    fail(f, &arguments(&["--labels", "none"]), 2, &none);
    let none = ["ablate needs true labels", "--truth-labels none was given"];
    fail(f, &arguments(&["--truth-labels", "none"]), 2, &none);
    fail(f, &arguments(&["--seed", "3"]), 2, &["--seed 3", "--seeds N"]);
    fail(f, &arguments(&["--set", "fusion.enabled=false"]), 2, &["`fusion.enabled`"]);
    fail(f, &arguments(&["--rows", "frs,frs"]), 2, &["--rows", "twice"]);
    write_labels(f, "blank", |_, _, _| 9999);
    let blank = ["--labels", "blank", "--unlabelled", "9999"];
    fail(f, &arguments(&blank), 1, &["ablate needs labels", "no pixel with a class"]);

    let noisy = ["--labels", "noisy", "--json"];
    let first = succeed(f, &arguments(&noisy));
    let progress = text(&first.stderr);
    assert!(progress.contains("run 12/12 (per-sample head, seed 2)"), "{progress}");
    let json: Value = serde_json::from_slice(&first.stdout).unwrap();
    let out = f.join("out");
    assert_eq!(names(&out), ["ablation.json", "ablation.md", "runs"]);
    assert_eq!(names(&out.join("runs")).len(), 12);
    assert_eq!(read(out.join("ablation.json")), text(&first.stdout));
    let number = |v: &Value| v.as_f64().unwrap_or_else(|| panic!("{v} is no number"));
    let rows = json["rows"].as_array().unwrap();
    let row_names: Vec<&str> = rows.iter().map(|r| r["name"].as_str().unwrap()).collect();
    let all = ["neither", "MTFF", "FRS", "both", "both, no local module", "per-sample head"];
    assert_eq!(row_names, all);
    for row in rows {
        let runs = row["runs"].as_array().unwrap();
        let miou: Vec<f64> = runs.iter().map(|r| number(&r["classes"]["miou_percent"])).collect();
        let over = &row["figures"]["miou_percent"];
        assert!((number(&over["mean"]) - 0.5 * (miou[0] + miou[1])).abs() < 1e-9, "{row:#}");
        let spread = (miou[0] - miou[1]).abs() / 2.0_f64.sqrt();
        assert!(spread > 0.0, "the seeds differ: {miou:?}");
        assert!((number(&over["standard_deviation"]) - spread).abs() < 1e-9, "{row:#}");
        assert!(number(&row["figures"]["mapping_iteration_s"]["mean"]) > 0.0);
        assert!(number(&row["figures"]["ate_rmse_cm"]["mean"]).is_finite());
        let p = &row["parameters"];
        assert_eq!(p["fusion"].as_u64() > Some(0), row["fusion"] == true, "{p}");
        assert_eq!(p["anchors"].as_u64() > Some(0), row["suppressor"] == true, "{p}");
        assert_eq!(p["anchors_in_use"].as_u64() > Some(0), row["suppressor"] == true, "{p}");
        let classes = json["sequence"]["classes"].as_u64().unwrap();
        let per_sample = row["head"] == "sample";
        let head = if per_sample { 33 * 256 + 2 * 257 * 256 + 257 * classes } else { 17 * classes };
        assert_eq!(p["class_head"].as_u64(), Some(head));
        let decoder = if per_sample { 0 } else { 32 * 32 + 32 + 32 * 16 + 16 };
        assert_eq!(p["semantic_decoder"].as_u64(), Some(decoder));
    }
    let at = |row: usize| number(&rows[row]["figures"]["miou_percent"]["mean"]);
    assert!(at(0) != at(1) && at(0) != at(2) && at(1) != at(3), "every row is another");
    assert!(at(3) != at(4) && at(0) != at(5), "every row is another");
    let fusion = |row: usize| rows[row]["parameters"]["fusion"].as_u64().unwrap();
    // The depthwise convolution: 3 x 3 and a bias for each of 16 channels.
    assert_eq!(fusion(3) - fusion(4), 10 * 16);
    let gain = number(&rows[3]["figures"]["miou_gain_over_neither_points"]["mean"]);
    assert!((gain - (at(3) - at(0))).abs() < 1e-9);
    let accuracy = number(&json["input_labels"]["pixel_accuracy_percent"]);
    assert!((70.0..90.0).contains(&accuracy), "{accuracy}");
    let markdown = read(out.join("ablation.md"));
    let lines = ["| row ", "| input labels ", "| neither ", "| both, no local module "];
    for line in lines.iter().chain(&["| MTFF ", "| FRS ", "| both ", "| per-sample head "]) {
        assert!(markdown.contains(line), "{markdown}");
    }
    let small = rows[0]["runs"][0]["small_class_names"].as_array().unwrap();
    assert_eq!(markdown.contains("IoU of the thin and small classes"), !small.is_empty());

    // A run is what `run` gives with the same settings.
    let mut plain = vec!["run", "room", "--out", "plain", "--labels", "noisy", "--no-mesh"];
    plain.extend(arguments(&[]).split_off(6));
    plain.extend(["--json", "--render-every", "5", "--seed", "2"]);
    plain.extend(["--set", "fusion.enabled=false"]);
    let plain = json_of(f, &plain);
    let kept: Value = serde_json::from_str(&read(out.join("runs/frs-2.json"))).unwrap();
    assert_eq!(kept["classes"]["miou_percent"], plain["semantics"]["miou_percent"]);
    assert_eq!(kept["ate_rmse_cm"], plain["trajectory"]["aligned_cm"]["rmse"]);

    // Fewer rows: none is computed again, and gains need the first one.
    let fewer = succeed(f, &arguments(&["--labels", "noisy", "--json", "--rows", "frs,neither"]));
    let fewer: Value = serde_json::from_slice(&fewer.stdout).unwrap();
    assert_eq!(fewer["rows"].as_array().unwrap().len(), 2);
    assert_eq!(fewer["rows"][0]["figures"], rows[2]["figures"]);

    // Started again, it computes what is missing and nothing else.
    let before = kept;
    fs::remove_file(out.join("runs/frs-2.json")).unwrap();
    let again = succeed(f, &arguments(&noisy));
    let progress = text(&again.stderr);
    assert!(progress.contains("12 runs, 11 of them kept"), "{progress}");
    assert!(progress.contains("(FRS, seed 2)") && !progress.contains("(both, seed 2)"));
    let after: Value = serde_json::from_str(&read(out.join("runs/frs-2.json"))).unwrap();
    assert_eq!(before["classes"], after["classes"]);
    // Runs of other settings are neither mixed in nor thrown away.
    let other = mte_slam(f, &arguments(&["--labels", "noisy", "--set", "mapping.window=3"]));
    let message = text(&other.stderr);
    assert_eq!(other.status.code(), Some(1), "{message}");
    assert!(message.contains("neither-1.json") && message.contains("config_hash"), "{message}");
    let other = mte_slam(f, &arguments(&["--labels", "dataset"]));
    let message = text(&other.stderr);
    assert!(message.contains("labels: found \"noisy\", expected \"dataset\""), "{message}");
    fs::write(out.join("runs/mtff-1.json"), "{").unwrap();
    let other = mte_slam(f, &arguments(&noisy));
    assert!(text(&other.stderr).contains("mtff-1.json"), "{}", text(&other.stderr));
}

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
    fail(folder.path(), &run_arguments(&[]), 1, &["frame000004.png has no depth image"]);
}

#[test]
fn a_true_mesh_that_is_none_is_an_error() {
    spoiled("mesh.ply", |_| b"not a mesh".to_vec(), &[], &["mesh.ply"]);
    let folder = recording();
    fail(folder.path(), &run_arguments(&["--mesh", "none.ply"]), 1, &["none.ply"]);
}

#[test]
fn frames_without_depth_or_pose_do_not_stop_a_run() {
    let folder = recording();
    let room = folder.path().join("room");
    // Frame 3: no depth at all; frame 2: a pose of -inf, which evaluation masks.
    let depth = room.join("results/depth000003.png");
    let empty = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::new(64, 48);
    empty.save(&depth).unwrap();
    let poses = read(room.join("traj.txt"));
    let poses: Vec<String> = poses
        .lines()
        .enumerate()
        .map(|(i, l)| if i == 2 { vec!["-inf"; 16].join(" ") } else { l.to_owned() })
        .collect();
    fs::write(room.join("traj.txt"), poses.join("\n") + "\n").unwrap();
    let output = succeed(folder.path(), &run_arguments(&["--json", "--no-mesh"]));
    let json: Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    assert_eq!(json["trajectory"]["pairs"], FRAMES - 1, "{json:#}");
    assert_eq!(json["lost_frames"], serde_json::json!([3]), "{json:#}");
    assert_eq!(read(folder.path().join("out/trajectory.txt")).lines().count(), FRAMES + 1);
}

#[test]
fn help_and_information_work_without_anything() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    for command in [
        "demo", "run", "eval", "ablate", "mesh", "render", "synth", "inspect", "convert", "info",
        "bench", "shaders",
    ] {
        let help = text(&succeed(f, &[command, "--help"]).stdout);
        assert!(help.contains("Usage:"), "{help}");
    }
    let info: Value = serde_json::from_slice(&succeed(f, &["info", "--json"]).stdout).unwrap();
    assert!(info["adapters"].is_array());
    let version = text(&succeed(f, &["--version"]).stdout);
    assert!(version.starts_with("mte-slam "), "{version}");
    succeed(f, &["shaders", "wgsl"]);
    let shaders = names(&f.join("wgsl"));
    assert!(shaders.contains(&"adam.wgsl".to_owned()), "{shaders:?}");
    assert!(!read(f.join("wgsl/adam.wgsl")).contains("#import"));
}
