//! Replica in the render of NICE-SLAM. The other render, that of vMAP, differs in its names and in
//! its unit of depth alone.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    entries::{Entries, Entry, depth_of, trajectory},
    folder::{COLOR_ENDS, Folder, plural},
    intrinsics::Intrinsics,
};
use mte_slam_types::sequence::SequenceError;
use std::collections::BTreeMap;

pub(super) struct Replica;

impl LayoutFiles for Replica {
    fn name(&self) -> &'static str {
        "replica"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "NICE-SLAM's render",
            color: "`results/frame000000.jpg`",
            depth: "`results/depth000000.png`, 1/6553.5 m",
            poses: "`traj.txt`",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![
            ("results/frame<number>.jpg|png", folder.count("results/frame", &COLOR_ENDS)),
            ("results/depth<number>.png", folder.count("results/depth", &[".png"])),
        ]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        let colors = folder.numbered("results/frame", &COLOR_ENDS)?;
        let depths = folder.numbered("results/depth", &[".png"])?;
        read(folder, colors, depths, "results/depth", 1.0 / 6553.5, wanted)
    }
}

/// Reads either render of Replica.
pub(super) fn read(
    folder: &Folder,
    colors: BTreeMap<u64, String>,
    depths: BTreeMap<u64, String>,
    depth_start: &str,
    depth_unit_m: f64,
    wanted: &Wanted,
) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let numbers: Vec<u64> = colors.keys().copied().collect();
    let poses = ["traj.txt", "traj_w_c.txt"].into_iter().find(|f| folder.has(f));
    let poses = match poses {
        Some(file) => trajectory(folder, file, &numbers)?,
        None => {
            warnings.push("neither traj.txt nor traj_w_c.txt".into());
            vec![None; numbers.len()]
        }
    };
    let mut frames = Vec::with_capacity(numbers.len());
    for ((number, color), truth) in colors.into_iter().zip(poses) {
        let depth = depth_of(&depths, number, depth_start, ".png");
        frames.push(Entry::of_files(number, color, depth, truth));
    }
    let surplus = depths.keys().filter(|n| numbers.binary_search(n).is_err()).count();
    if surplus > 0 {
        warnings
            .push(format!("{} without a colour image left out", plural(surplus, "depth image")));
    }
    let intrinsics = wanted.camera_or(folder, || {
        warnings.push("no cam_params.json: Replica's usual camera taken (1200x680, f 600)".into());
        let from = "Replica (there is no cam_params.json)";
        Ok(Intrinsics::fixed(from, (1200, 680), [600.0, 600.0, 599.5, 339.5]))
    })?;
    let (invalid_depth, bounds) = (None, None);
    Ok(Entries { frames, intrinsics, depth_unit_m, invalid_depth, bounds, warnings })
}
