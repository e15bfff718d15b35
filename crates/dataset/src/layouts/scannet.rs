//! ScanNet as its exporter leaves it.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    wanted::Wanted,
};
use crate::{
    entries::{Entries, Entry, depth_of},
    folder::{COLOR_ENDS, Folder},
    intrinsics::{self, Intrinsics},
    pose_text::parse_matrix,
};
use mte_slam_types::sequence::SequenceError;

/// The depth camera of most scenes.
const USUAL: [f64; 4] = [577.590698, 578.729797, 318.905426, 242.683609];

pub(super) struct ScanNet;

impl LayoutFiles for ScanNet {
    fn name(&self) -> &'static str {
        "scannet"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "exported",
            color: "`color/0.jpg`",
            depth: "`depth/0.png`, mm",
            poses: "`pose/0.txt`",
            labels: "`label-filt/0.png`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![
            ("color/<number>.jpg|png", folder.count("color/", &COLOR_ENDS)),
            ("depth/<number>.png", folder.count("depth/", &[".png"])),
            ("pose/<number>.txt", folder.count("pose/", &[".txt"])),
        ]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        read(folder, wanted)
    }
}

/// Reads everything but the images of `color/`, `depth/`, `pose/` and `intrinsic/`.
fn read(folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let colors = folder.numbered("color/", &COLOR_ENDS)?;
    let depths = folder.numbered("depth/", &[".png"])?;
    let poses = folder.numbered("pose/", &[".txt"])?;
    let mut frames = Vec::with_capacity(colors.len());
    for (number, color) in colors {
        let depth = depth_of(&depths, number, "depth/", ".png");
        let truth = match poses.get(&number) {
            Some(file) => parse_matrix(file, Some(number), &folder.text(file)?)?,
            None => None,
        };
        frames.push(Entry::of_files(number, color, depth, truth));
    }
    let intrinsics =
        wanted.camera_or(folder, || exported_camera(folder, &frames, &mut warnings))?;
    Ok(Entries {
        frames,
        intrinsics,
        depth_unit_m: 1e-3,
        invalid_depth: None,
        bounds: None,
        warnings,
    })
}

/// `intrinsic/intrinsic_depth.txt`, or the usual camera.
fn exported_camera(
    folder: &Folder,
    frames: &[Entry],
    warnings: &mut Vec<String>,
) -> Result<Intrinsics, SequenceError> {
    const DEPTH: &str = "intrinsic/intrinsic_depth.txt";
    const COLOR: &str = "intrinsic/intrinsic_color.txt";
    if !folder.has(DEPTH) {
        warnings
            .push(format!("no {DEPTH}: the depth camera of most ScanNet scenes taken (f 577.6)"));
        let from = "ScanNet (there is no intrinsic/intrinsic_depth.txt)";
        return Ok(Intrinsics::fixed(from, (640, 480), USUAL));
    }
    let camera = intrinsics::from_matrix(folder, DEPTH)?;
    if let (true, Some(first)) = (folder.has(COLOR), frames.first()) {
        let color = intrinsics::from_matrix(folder, COLOR)?.focal_centre;
        let color_size = first.color.size(folder, first.number, "colour image")?;
        let depth_size = first.depth.size(folder, first.number, "depth image")?;
        Intrinsics { size: Some(depth_size), ..camera.clone() }
            .note_color(color, color_size, warnings);
    }
    Ok(camera)
}
