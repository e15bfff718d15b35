//! The evaluation protocols as people run them: `eval` on the files of a run, with true meshes whose
//! figures are known.
use crate::program::{TINY, json, json_of, mte_slam, succeed, text};
use mte_slam_mesh::{read_ply, write_ply};
use serde_json::Value;
use std::{fs, path::Path, sync::OnceLock};
use tempfile::TempDir;

/// A written sequence with views from other poses, and a small run on it.
fn shared() -> &'static Path {
    static SHARED: OnceLock<TempDir> = OnceLock::new();
    SHARED
        .get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let at = folder.path();
            succeed(at, &["synth", "room", "--frames", "6", "--width", "64", "--novel", "3"]);
            let run = [&["run", "room", "--out", "run", "-q"][..], &TINY].concat();
            succeed(at, &run);
            folder
        })
        .path()
}

/// A copy of the run whose mesh is another.
fn with_mesh(name: &str, mesh: &[u8]) {
    let (from, to) = (shared().join("run"), shared().join(name));
    fs::create_dir_all(to.join("renders")).unwrap();
    for file in ["trajectory.txt", "timings.csv", "config.toml", "metrics.json"] {
        fs::copy(from.join(file), to.join(file)).unwrap();
    }
    fs::write(to.join("mesh.ply"), mesh).unwrap();
}

fn number(json: &Value, path: &[&str]) -> f64 {
    let found = path.iter().fold(json, |v, k| &v[k]);
    found.as_f64().unwrap_or_else(|| panic!("{path:?}: {json:#}"))
}

#[test]
fn a_run_has_every_figure_with_its_protocol() {
    let json = json(&shared().join("run/metrics.json"));
    for (section, word) in [
        ("trajectory", "SE(3)"),
        ("depth", "views"),
        ("semantics", "one confusion matrix"),
        ("mesh", "ESLAM"),
        ("mesh_coslam", "Co-SLAM"),
        ("novel_views", "none of which the map has seen"),
        ("time", "95th percentile"),
        ("memory", "peak"),
    ] {
        let protocol = json[section]["protocol"].as_str().unwrap_or_default();
        assert!(protocol.contains(word), "{section}: {protocol:?}");
    }
    for (path, id) in [
        ("/trajectory", "ate/rigid@1"),
        ("/renders", "renders/estimated-poses@1"),
        ("/depth", "depth-l1/views@1"),
        ("/color", "psnr/views@1"),
        ("/semantics", "miou/all-images@1"),
        ("/semantics/boundary", "boundary/3-pixels@1"),
        ("/mesh", "surface/eslam@1"),
        ("/mesh_coslam", "surface/coslam@1"),
        ("/novel_views", "novel/recording@1"),
        ("/novel_views/semantics", "miou/all-images@1"),
        ("/time", "time/per-frame@1"),
        ("/memory", "memory/peak@1"),
    ] {
        let object = json.pointer(path).unwrap_or_else(|| panic!("{path}: {json:#}"));
        assert_eq!(object["protocol_id"], id, "{path}");
        assert!(object["protocol"].as_str().is_some_and(|sentence| !sentence.is_empty()), "{path}");
    }
    // Depth L1 of the mesh has a reason where six frames of a room leave no view.
    assert!(json["mesh_depth"].is_object() || json["absent"]["mesh_depth"].is_string());
    assert_eq!(json["novel_views"]["views"], 3);
    assert!(number(&json, &["novel_views", "semantics", "miou_percent"]) > 0.0);
    assert!(number(&json, &["novel_views", "depth", "l1_cm"]) > 0.0);
    let peak = number(&json, &["memory", "peak_device_bytes"]);
    assert!(peak >= number(&json, &["memory", "device_bytes"]) && peak > 1e6);
    assert!(number(&json, &["time", "last_optimisation_s"]) > 0.0);
}

#[test]
fn the_true_mesh_against_itself_and_moved() {
    let truth = fs::read(shared().join("room/mesh.ply")).unwrap();
    with_mesh("same", &truth);
    let mut arguments = vec!["eval", "same", "room", "--json", "--mesh-views", "50"];
    arguments.extend(["--cull", "coslam,eslam,frustum"]);
    let same = json_of(shared(), &arguments);
    for section in ["mesh", "mesh_coslam", "mesh_frustum"] {
        assert!(number(&same, &[section, "point_to_surface", "accuracy_cm"]) < 1e-3, "{section}");
        assert_eq!(
            number(&same, &[section, "point_to_surface", "completion_ratio_percent"]),
            100.0
        );
        let (a, b) = ("estimated_area_m2", "true_area_m2");
        assert_eq!(number(&same, &[section, a]), number(&same, &[section, b]), "culled alike");
        // Two samplings of one surface are as far apart as the floor says.
        let apart = number(&same, &[section, "point_to_point", "accuracy_cm"]);
        let floor = number(&same, &[section, "sampling_floor_cm"]);
        assert!((apart - floor).abs() < 0.05 * floor, "{section}: {apart} {floor}");
    }
    // What is hidden stays by the frustum alone.
    let area = |section| number(&same, &[section, "true_area_m2"]);
    assert!(area("mesh_frustum") > area("mesh_coslam"), "{same:#}");
    // Moved as a whole, culled by the frustum that hardly notices: between nothing and the shift.
    let mut mesh = read_ply(&truth).unwrap();
    mesh.positions.iter_mut().for_each(|p| p[0] += 0.03);
    with_mesh("moved", &write_ply(&mesh).unwrap());
    let arguments = ["eval", "moved", "room", "--json", "--cull", "frustum", "--mesh-views", "0"];
    let moved = json_of(shared(), &arguments);
    let accuracy = number(&moved, &["mesh_frustum", "point_to_surface", "accuracy_cm"]);
    assert!((0.2..3.0).contains(&accuracy), "{accuracy}");
    assert!(moved.get("mesh").is_none() && moved.get("mesh_coslam").is_none());
    let mut again = arguments.to_vec();
    again.push("--icp");
    let aligned = json_of(shared(), &again);
    let after = number(&aligned, &["mesh_frustum", "point_to_surface", "accuracy_cm"]);
    assert!(after < 0.3 * accuracy, "{after} after ICP, {accuracy} before");
    let protocol = aligned["mesh_frustum"]["protocol"].as_str().unwrap().to_owned();
    assert!(protocol.contains("after ICP"), "{protocol}");
    assert_eq!(aligned["mesh_frustum"]["protocol_id"], "surface/frustum-icp@1");
}

#[test]
fn views_are_written_down_and_follow_the_seed() {
    let view = |name: &str, seed: &str| -> Value {
        let file = format!("{name}.json");
        let mut arguments = vec!["eval", "run", "room", "--json", "--write-views", &file];
        arguments.extend(["--eval-seed", seed, "--cull", "coslam", "--mesh-views", "20"]);
        let figures = json_of(shared(), &arguments);
        assert_eq!(figures["mesh_coslam"]["seed"].to_string(), seed);
        json(&shared().join(&file))
    };
    let (a, b, c) = (view("a", "3"), view("b", "3"), view("c", "4"));
    assert_eq!(a, b);
    assert_ne!(a["culling"], c["culling"]);
    assert_eq!(a["real"].as_array().unwrap().len(), 6);
    assert_eq!(a["culling"].as_array().unwrap().len(), 100);
    assert_eq!(a["culling"][0].as_array().unwrap().len(), 16);
    assert_eq!(a["depth_camera"]["width"], 500);
    assert!(a["unseen"].as_array().unwrap().len() > 1000, "six frames leave much unseen");
}

#[test]
fn the_peers_class_protocol_and_novel_views_need_the_map() {
    let arguments = ["eval", "run", "room", "--json", "--mesh-views", "0", "--engine", "cpu"];
    let plain = json_of(shared(), &arguments);
    // DATASET/novel is there, and so is the checkpoint.
    assert_eq!(plain["novel_views"]["views"], 3);
    assert!(plain.get("semantics_sni").is_none());
    let mut sni = arguments.to_vec();
    sni.extend(["--miou-protocol", "sni", "--novel", "room"]);
    let sni = json_of(shared(), &sni);
    assert_eq!(sni["semantics_sni"]["frame"], 0);
    assert!(number(&sni, &["semantics_sni", "miou_percent"]) > 0.0);
    assert!(number(&sni, &["semantics_sni", "pixel_accuracy_percent"]) <= 100.0);
    assert_eq!(sni["novel_views"]["views"], 6, "the recording given, not the one beside");
    assert_eq!(plain["semantics"], sni["semantics"], "the full-set figure stays");
    // Rendered again by the head the classes are those of the run; anchors say something near it.
    let by = |inference: &str| {
        let mut arguments = arguments.to_vec();
        arguments.extend(["--inference", inference]);
        let mut again = json_of(shared(), &arguments)["semantics_by_inference"].take();
        let said = again.as_object_mut().unwrap().remove("inference");
        assert_eq!(said.unwrap(), inference);
        again
    };
    assert_eq!(by("head"), plain["semantics"]);
    let accuracy = |figures: &Value| number(figures, &["pixel_accuracy_percent"]);
    let anchors = by("anchors");
    assert_ne!(anchors, plain["semantics"]);
    assert!((accuracy(&anchors) - accuracy(&plain["semantics"])).abs() < 5.0, "{anchors:#}");
    // Without a checkpoint only what was asked for by name is an error.
    with_mesh("bare", &fs::read(shared().join("run/mesh.ply")).unwrap());
    let bare = json_of(shared(), &["eval", "bare", "room", "--json", "--mesh-views", "0"]);
    assert!(bare.get("novel_views").is_none());
    let failed = mte_slam(shared(), &["eval", "bare", "room", "--miou-protocol", "sni"]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("checkpoint.safetensors"));
}

#[test]
fn help_names_every_protocol() {
    let help = text(&succeed(shared(), &["eval", "--help"]).stdout);
    for word in [
        "mesh_coslam",
        "mesh_frustum",
        "mesh_depth",
        "semantics_sni",
        "novel_views",
        "0.3, 0.7, 0.7",
        "200,000 samples",
        "SE(3)",
        "95th percentile",
        "ESLAM",
        "NICE-SLAM",
    ] {
        assert!(help.contains(word), "{word}: {help}");
    }
}
