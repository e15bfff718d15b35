//! `mte-slam ablate`.
use crate::program::*;
use mte_slam_core::map::HAS_SAMPLE_HEAD;
use serde_json::Value;
use std::fs;

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
    // The last row is there in builds with its feature only.
    let names_of_rows: &[&str] =
        &["neither", "MTFF", "FRS", "both", "both, no local module", "per-sample head"];
    let expected_rows = &names_of_rows[..5 + usize::from(HAS_SAMPLE_HEAD)];
    let total = 2 * expected_rows.len();
    if !HAS_SAMPLE_HEAD {
        let rows = arguments(&["--rows", "sample-head"]);
        fail(f, &rows, 2, &["--rows sample-head", "feature `sample-head`"]);
        let rows = ["run", "room", "--out", "head", "--set", "semantics.head=sample"];
        fail(f, &rows, 2, &["semantics.head", "feature `sample-head`"]);
    }
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
    let last = format!("run {total}/{total} ({}, seed 2)", expected_rows[expected_rows.len() - 1]);
    assert!(progress.contains(&last), "{progress}");
    let json: Value = serde_json::from_slice(&first.stdout).unwrap();
    let out = f.join("out");
    assert_eq!(names(&out), ["ablation.json", "ablation.md", "runs"]);
    assert_eq!(names(&out.join("runs")).len(), total);
    assert_eq!(read(out.join("ablation.json")), text(&first.stdout));
    let number = |v: &Value| v.as_f64().unwrap_or_else(|| panic!("{v} is no number"));
    let rows = json["rows"].as_array().unwrap();
    let row_names: Vec<&str> = rows.iter().map(|r| r["name"].as_str().unwrap()).collect();
    assert_eq!(row_names, expected_rows);
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
    assert!(at(3) != at(4), "every row is another");
    assert!(!HAS_SAMPLE_HEAD || at(0) != at(5), "every row is another");
    let fusion = |row: usize| rows[row]["parameters"]["fusion"].as_u64().unwrap();
    // The depthwise convolution: 3 x 3 and a bias for each of 16 channels.
    assert_eq!(fusion(3) - fusion(4), 10 * 16);
    let gain = number(&rows[3]["figures"]["miou_gain_over_neither_points"]["mean"]);
    assert!((gain - (at(3) - at(0))).abs() < 1e-9);
    let accuracy = number(&json["input_labels"]["pixel_accuracy_percent"]);
    assert!((70.0..90.0).contains(&accuracy), "{accuracy}");
    let markdown = read(out.join("ablation.md"));
    let rows_and_head = ["row", "input labels"].iter().chain(expected_rows);
    for line in rows_and_head.map(|name| format!("| {name} ")) {
        assert!(markdown.contains(&line), "{markdown}");
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
    assert!(progress.contains(&format!("{total} runs, {} of them kept", total - 1)), "{progress}");
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
