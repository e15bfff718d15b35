//! 7-Scenes: all files of a frame side by side.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    entries::{Entries, Entry, depth_of},
    folder::Folder,
    intrinsics::Intrinsics,
    pose_text::parse_matrix,
};
use mte_slam_types::sequence::SequenceError;

const COLOR_ENDS: [&str; 3] = [".color.png", ".color.jpg", ".color.jpeg"];

pub(super) struct SevenScenes;

impl LayoutFiles for SevenScenes {
    fn name(&self) -> &'static str {
        "7scenes"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "",
            color: "`frame-000000.color.png`",
            depth: "`frame-000000.depth.png`, mm",
            poses: "`frame-000000.pose.txt`",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![
            ("frame-<number>.color.png|jpg", folder.count("frame-", &COLOR_ENDS)),
            ("frame-<number>.depth.png", folder.count("frame-", &[".depth.png"])),
        ]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        let mut warnings = Vec::new();
        let colors = folder.numbered("frame-", &COLOR_ENDS)?;
        let depths = folder.numbered("frame-", &[".depth.png"])?;
        let poses = folder.numbered("frame-", &[".pose.txt"])?;
        let mut frames = Vec::with_capacity(colors.len());
        for (number, color) in colors {
            let depth = depth_of(&depths, number, "frame-", ".depth.png");
            let truth = match poses.get(&number) {
                Some(file) => parse_matrix(file, Some(number), &folder.text(file)?)?,
                None => None,
            };
            frames.push(Entry::of_files(number, color, depth, truth));
        }
        let intrinsics = wanted.camera_or(folder, || {
            warnings.push("no camera-intrinsics.txt: f 585, centre 320 240 taken".into());
            let from = "7-Scenes (there is no camera-intrinsics.txt)";
            Ok(Intrinsics::fixed(from, (640, 480), [585.0, 585.0, 320.0, 240.0]))
        })?;
        Ok(Entries {
            frames,
            intrinsics,
            depth_unit_m: 1e-3,
            invalid_depth: Some(65535),
            bounds: None,
            warnings,
        })
    }
}
