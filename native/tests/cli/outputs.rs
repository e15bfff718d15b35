//! The files of an output folder, and what is made of them.
use crate::program::*;
use serde_json::Value;
use std::fs;

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
        "demo", "run", "eval", "ablate", "mesh", "objects", "render", "synth", "inspect",
        "convert", "info", "bench", "shaders",
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
