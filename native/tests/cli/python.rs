//! Python for the tests that compare with what others read and write.
use std::process::Command;

/// A Python 3 that has all of `modules`: `MTE_SLAM_PYTHON`, the first `python3`, or the system's.
/// Without one there is `None` after a message, or a failure where `MTE_SLAM_REQUIRE_PYTHON=1`.
pub fn with(modules: &[&str]) -> Option<String> {
    let named = std::env::var("MTE_SLAM_PYTHON").ok();
    // The first `python3` need not be the one that the system's packages belong to.
    let mut candidates = named.into_iter().chain(["python3", "/usr/bin/python3"].map(String::from));
    let import = format!("import {}", modules.join(", "));
    let found = candidates.find(|python| {
        let tried = Command::new(python).args(["-c", &import]).output();
        tried.is_ok_and(|o| o.status.success())
    });
    if found.is_none() {
        let needed = std::env::var("MTE_SLAM_REQUIRE_PYTHON").is_ok_and(|v| v == "1");
        let what = format!(
            "no Python 3 with {}; 'pip install -r tests/requirements.txt' brings them",
            modules.join(" and ")
        );
        assert!(!needed, "{what}");
        println!("skipped: {what}");
    }
    found
}
