//! Objects of a run's mesh.
use crate::program::*;
use serde_json::Value;
use std::fs;
use tempfile::TempDir;

/// The shared run, to be changed.
fn finished_run() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&shared().folder.path().join("demo"), &folder.path().join("demo"));
    folder
}

#[test]
fn objects_are_listed_and_written_apart() {
    let folder = finished_run();
    let (f, out) = (folder.path(), folder.path().join("demo"));
    let stdout = text(&succeed(f, &["objects", "demo", "--json"]).stdout);
    assert_eq!(stdout, read(out.join("objects.json")));
    let json: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((&json["format"], &json["version"]), (&"mte-slam-objects".into(), &1.into()));
    assert_eq!(json["settings"]["gap_m"], 0.05);
    // The floor is level in the built-in room, and its walls are along x and y.
    assert!(json["axes"]["up"][2].as_f64().unwrap() > 0.999, "{json:#}");
    assert!(json["axes"]["yaw_deg"].as_f64().unwrap().abs() < 3.0, "{json:#}");
    let objects = json["objects"].as_array().unwrap();
    let walls = objects.iter().filter(|o| o["class"]["name"] == "wall");
    assert!(walls.clone().count() >= 1 && walls.clone().all(|o| o["structure"] == true));
    assert!(objects.iter().any(|o| o["structure"] == false), "{json:#}");
    for (i, o) in objects.iter().enumerate() {
        assert_eq!(o["id"], i);
        assert!(o["name"].as_str().unwrap().starts_with(o["class"]["name"].as_str().unwrap()));
        assert!(o["triangles"].as_u64().unwrap() >= 12 && o["area_m2"].as_f64().unwrap() >= 0.01);
        assert_eq!(o["extent_m"].as_array().unwrap().len(), 3);
    }

    let glb = fs::read(out.join("objects.glb")).unwrap();
    let length = u32::from_le_bytes(*glb[12..].first_chunk().unwrap()) as usize;
    let scene: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let nodes = scene["nodes"].as_array().unwrap();
    assert_eq!(nodes.len(), objects.len());
    for (node, object) in nodes.iter().zip(objects) {
        assert_eq!((&node["name"], &node["extras"]["id"]), (&object["name"], &object["id"]));
        assert_eq!(node["extras"]["class_id"], object["class"]["id"]);
    }

    // Again, and as text: the same files.
    let listed = text(&succeed(f, &["objects", "demo"]).stdout);
    assert!(listed.contains("wall 1") && listed.contains("objects.glb"), "{listed}");
    assert_eq!(stdout, read(out.join("objects.json")));
    assert!(glb == fs::read(out.join("objects.glb")).unwrap());
    // Other choices, other objects.
    let all = ["--min-area", "0", "--min-triangles", "1", "--gap", "0", "--structure", "wall,lamp"];
    let more: Value =
        json_of(f, &[&["objects", "demo", "--json", "--up", "0,0,2"][..], &all].concat());
    assert!(more["objects"].as_array().unwrap().len() > objects.len());
    assert_eq!(more["dropped"]["parts"], 0);
    assert_eq!(more["axes"]["up"], serde_json::json!([0.0, 0.0, 1.0]));
    let floor = |o: &&Value| o["class"]["name"] == "floor";
    assert!(
        more["objects"].as_array().unwrap().iter().filter(floor).all(|o| o["structure"] == false)
    );
}

#[test]
fn what_objects_cannot_be_made_of_is_said() {
    let folder = finished_run();
    let (f, out) = (folder.path(), folder.path().join("demo"));
    let usage: [(&[&str], &[&str]); 5] = [
        (&["--up", "0,0,0"], &["--up", "direction"]),
        (&["--up", "1,2"], &["--up", "2 numbers"]),
        (&["--up=-1,nan,0"], &["--up", "direction"]),
        (&["--gap", "7"], &["--gap", "0.001 to 1"]),
        (&["--min-area=-1"], &["--min-area", "0 or more"]),
    ];
    for (arguments, parts) in usage {
        fail(f, &[&["objects", "demo"][..], arguments].concat(), 2, parts);
    }
    fail(f, &["objects", "nothing"], 1, &["nothing", "output folder of a run"]);
    let ply = fs::read(out.join("mesh.ply")).unwrap();
    fs::write(out.join("mesh.ply"), &ply[..ply.len() / 2]).unwrap();
    fail(f, &["objects", "demo"], 1, &["mesh.ply", "end of the file"]);
    fs::write(out.join("mesh.ply"), &ply).unwrap();
    fs::copy(out.join("mesh.ply"), out.join("mesh_semantic.ply")).unwrap();
    fail(f, &["objects", "demo"], 1, &["mesh_semantic.ply", "no classes"]);
    fs::remove_file(out.join("mesh_semantic.ply")).unwrap();
    fail(f, &["objects", "demo"], 1, &["mesh_semantic.ply", "labels"]);
    assert!(!out.join("objects.json").exists(), "nothing was written");
}
