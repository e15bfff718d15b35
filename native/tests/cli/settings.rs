//! The list of settings, and the documents that are made of it.
use crate::program::*;
use mte_slam_core::config::guide;
use std::{fs, path::Path};

/// Compares a file of the repository, or writes it where `MTE_SLAM_WRITE` is set.
fn compare(file: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    if std::env::var_os("MTE_SLAM_WRITE").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == text,
        "{file} is not what the settings say: run this test with MTE_SLAM_WRITE=1"
    );
}

#[test]
fn the_guide_and_the_types_are_those_of_the_settings() {
    compare("docs/guide/configuration.md", &guide::markdown());
    compare("web/src/settings.d.ts", &guide::typescript());
}

#[test]
fn settings_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let printed = |arguments: &[&str]| text(&succeed(f, arguments).stdout);
    let all = printed(&["settings"]);
    let rays = printed(&["settings", "mapping.rays", "--preset", "tiny"]);
    assert!(all.contains("odometry.align.max_points = 6000") && all.contains("[m]"), "{all}");
    assert!(rays.starts_with("mapping.rays = 600\n") && rays.lines().count() == 2, "{rays}");
    assert_eq!(printed(&["settings", "--markdown"]), guide::markdown());
    fail(f, &["settings", "qqq"], 2, &["qqq"]);
    fail(f, &["settings", "--preset", "warp"], 2, &["tiny, fast"]);
}
