//! Labels and features from elsewhere.
use crate::program::*;
use std::fs;

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
