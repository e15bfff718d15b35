//! Small text files: class lists, TUM trajectories, configurations. The first byte says which.
#![no_main]
use libfuzzer_sys::fuzz_target;
use mte_slam_dataset::ClassList;
use mte_slam_fuzz::limit_memory;

// The program's own readers; they are in a binary, which cannot be linked.
#[allow(dead_code)]
#[path = "../../native/src/configuration.rs"]
mod configuration;
#[path = "../../crates/report/src/errors.rs"]
mod report_errors;
mod errors {
    pub(crate) use crate::{UsageError, usage};
}
use report_errors::UsageError;
// A file alone, so that the figures' threads stay out of the targets.
#[allow(dead_code)]
#[path = "../../crates/report/src/trajectory.rs"]
mod trajectory;

/// What of the command line the configuration reads (`native/src/args.rs`).
mod args {
    #[derive(Clone, Copy)]
    #[allow(dead_code)]
    pub enum TrackerChoice {
        Align,
        Render,
        Truth,
    }

    #[derive(Default)]
    pub struct ConfigArgs {
        pub preset: Option<String>,
        pub config: Option<std::path::PathBuf>,
        pub set: Vec<String>,
        pub tracker: Option<TrackerChoice>,
        pub seed: Option<u32>,
    }
}

fuzz_target!(init: limit_memory(), |data: &[u8]| {
    let Some((&which, bytes)) = data.split_first() else { return };
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match which % 4 {
        0 => {
            if let Ok(list) = ClassList::parse("classes.json", text) {
                let ids: Vec<u16> = list.table.classes.iter().map(|c| c.raw_id).collect();
                assert!(ids.is_sorted_by(|a, b| a < b));
            }
        }
        1 => {
            let Ok(poses) = trajectory::read_tum("trajectory.txt", text) else { return };
            let written = trajectory::write_tum(poses.iter().copied());
            let again = trajectory::read_tum("written", &written).expect("what was written");
            assert!(poses.iter().zip(&again).all(|(a, b)| a.0 == b.0));
            assert_eq!(poses.len(), again.len());
        }
        2 => {
            // As with `--config FILE`.
            let file = Some(("config.toml", text));
            if let Ok(found) = configuration::with_file(&args::ConfigArgs::default(), "fast", file)
            {
                let written = configuration::to_toml(&found.config).expect("TOML");
                let file = Some(("written", written.as_str()));
                let again = configuration::with_file(&args::ConfigArgs::default(), "fast", file);
                assert!(again.expect("what was written").config == found.config);
            }
        }
        _ => {
            let set = text.lines().map(String::from).collect();
            let args = args::ConfigArgs { set, ..Default::default() };
            let _ = configuration::with_file(&args, "fast", None);
        }
    }
});
