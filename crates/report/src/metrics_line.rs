//! The figures of a finished run in a line.
use serde_json::Value;
use std::{fs, path::Path};

/// Of an output folder; those figures that there are.
pub fn of_folder(folder: &Path) -> String {
    let text = fs::read_to_string(folder.join("metrics.json")).unwrap_or_default();
    let json: Value = serde_json::from_str(&text).unwrap_or_default();
    let figures = [
        ("ATE", json["trajectory"]["aligned_cm"]["rmse"].as_f64(), 3, " cm"),
        ("depth", json["depth"]["l1_cm"].as_f64(), 2, " cm"),
        ("mIoU", json["semantics"]["miou_percent"].as_f64(), 2, " %"),
    ];
    let parts: Vec<String> = figures
        .into_iter()
        .filter_map(|(name, value, decimals, unit)| {
            Some(format!("{name} {:.decimals$}{unit}", value?))
        })
        .collect();
    if parts.is_empty() { "done".to_owned() } else { parts.join(", ") }
}
