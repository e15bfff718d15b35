//! Classes from a network: the same as its labels from files, scored, refused where it does not fit.
#[path = "../../../crates/segment/tests/onnx/mod.rs"]
mod onnx;

use crate::program::*;
use onnx::{Graph, NAMES, PLAIN};
use safetensors::SafeTensors;
use std::{fs, path::Path};

/// A network that names the nearest of four colours, in `folder/model`.
fn write_model(folder: &Path) {
    let model = folder.join("model");
    fs::create_dir_all(&model).unwrap();
    fs::write(model.join("model.onnx"), Graph::colors(1).model()).unwrap();
    fs::write(model.join("config.json"), NAMES).unwrap();
    fs::write(model.join("preprocessor_config.json"), PLAIN).unwrap();
}

#[test]
fn a_run_by_a_network_is_the_run_by_its_labels_to_the_byte() {
    let folder = recording();
    let f = folder.path();
    write_model(f);
    let said = succeed(f, &["label", "room", "--segmenter", "model", "--out", "labelled"]);
    assert!(text(&said.stdout).contains("6 frames labelled"), "{}", text(&said.stdout));
    assert!(text(&said.stderr).contains("logits [1, 4, 480, 640]"), "{}", text(&said.stderr));
    let confidence = image::open(f.join("labelled/confidence/000003.png")).unwrap();
    assert_eq!((confidence.width(), confidence.height()), (64, 48));

    let by_files = json_of(f, &run_arguments(&["--json", "--labels", "labelled"]));
    fs::rename(f.join("out"), f.join("by-files")).unwrap();
    let every = ["--json", "--segmenter", "model", "--segment-every", "1"];
    let by_network = json_of(f, &run_arguments(&every));
    for file in ["trajectory.txt", "mesh.ply", "mesh.glb", "mesh_semantic.ply", "mesh_semantic.glb"]
    {
        let read = |out: &str| fs::read(f.join(out).join(file)).unwrap();
        assert!(read("by-files") == read("out"), "{file}");
    }
    let read = |out: &str| fs::read(f.join(out).join("checkpoint.safetensors")).unwrap();
    let (a, b) = (read("by-files"), read("out"));
    let (a, b) = (SafeTensors::deserialize(&a).unwrap(), SafeTensors::deserialize(&b).unwrap());
    assert_eq!(a.names().len(), b.names().len());
    for name in a.names() {
        assert!(a.tensor(name).unwrap().data() == b.tensor(name).unwrap().data(), "{name}");
    }
    // Both are scored against the recording's labels, and so are the network's.
    assert_eq!(by_network["sequence"]["labels"], "segmenter model");
    assert_eq!(by_network["semantics"]["truth"], "dataset");
    assert_eq!(by_network["semantics"]["miou_percent"], by_files["semantics"]["miou_percent"]);
    assert_eq!(by_network["input_labels"], by_files["input_labels"]);

    // Again from the files: `eval` asks the network, too.
    let eval = json_of(f, &["eval", "out", "room", "--json"]);
    assert_eq!(eval["input_labels"], by_network["input_labels"]);
    assert_eq!(eval["semantics"]["miou_percent"], by_network["semantics"]["miou_percent"]);

    // By default as often as frames are mapped: another map, scored over the same frames.
    fs::rename(f.join("out"), f.join("by-network")).unwrap();
    let fewer = json_of(f, &run_arguments(&["--json", "--segmenter", "model"]));
    assert_eq!(fewer["input_labels"], by_network["input_labels"]);
    let read = |out: &str| fs::read(f.join(out).join("mesh_semantic.ply")).unwrap();
    assert!(read("by-network") != read("out"));
}

#[test]
fn classes_of_a_network_and_of_the_truth_meet_in_groups() {
    let folder = recording();
    let f = folder.path();
    write_model(f);
    // What the built-in room's things are, by the network's four names.
    let groups = r#"{"red": "warm", "rug": "warm", "sofa": "warm", "light": "plain", "wall": "plain",
        "ceiling": "plain", "green": "green", "plant": "green"}"#;
    fs::write(f.join("groups.json"), groups).unwrap();
    let extra = ["--json", "--no-mesh", "--segmenter", "model", "--groups", "groups.json"];
    let json = json_of(f, &run_arguments(&extra));
    let names: Vec<&str> = json["semantics"]["classes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["green", "plain", "warm"]);
    // The room's walls are light, and the network finds them.
    let of = |json: &serde_json::Value| json["pixel_accuracy_percent"].as_f64().unwrap();
    assert!(of(&json["input_labels"]) > 20.0, "{}", of(&json["input_labels"]));
    let warnings = json["warnings"].to_string();
    assert!(warnings.contains("classes have no group in groups.json"), "{warnings}");
}

#[test]
fn the_demo_maps_what_the_built_in_network_sees() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let mut demo = vec!["demo", "--json", "--frames", "4", "--width", "160", "--out", "out"];
    demo.extend(["--segmenter", "built-in", "--no-mesh"]);
    demo.extend(TINY);
    let json = json_of(f, &demo);
    let labels = json["input_labels"]["pixel_accuracy_percent"].as_f64().unwrap();
    assert!(labels > 55.0, "{labels} % of the network's labels are right");
    assert_eq!(json["semantics"]["truth"], "dataset");
}

#[test]
fn what_does_not_fit_is_refused_before_anything_slow() {
    let folder = recording();
    let f = folder.path();
    write_model(f);
    fs::write(f.join("bad.onnx"), "no network at all").unwrap();
    fs::create_dir(f.join("empty")).unwrap();
    fs::write(f.join("g.json"), r#"{"sky": "outdoors"}"#).unwrap();
    for (extra, code, parts) in [
        (&["--segmenter", "nowhere"][..], 1, &["nowhere", "no such file"][..]),
        (&["--segmenter", "empty"], 1, &["empty", "no .onnx file", "model.onnx"]),
        (&["--segmenter", "bad.onnx"], 1, &["bad.onnx", "cannot be loaded", "ONNX"]),
        (&["--segmenter", "model", "--labels", "x"], 2, &["--labels x", "--segmenter"]),
        (&["--segmenter", "model", "--segment-size", "9"], 2, &["512x384"]),
        (&["--segmenter", "model", "--min-confidence", "2"], 2, &["0 to 1"]),
        (&["--segmenter", "model", "--turn", "up"], 2, &["right", "left"]),
        (&["--segmenter", "model", "--groups", "nowhere"], 2, &["nowhere", "indoor"]),
        (&["--segmenter", "model", "--groups", "g.json"], 1, &["g.json", "none of the network's"]),
        (&["--segment-every", "2"], 2, &["--segmenter MODEL"]),
    ] {
        fail(f, &run_arguments(extra), code, parts);
    }
    fail(f, &["label", "room", "--out", "out"], 2, &["--segmenter"]);
}
