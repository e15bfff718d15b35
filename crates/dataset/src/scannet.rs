//! ScanNet as its exporter leaves it, and its table of label ids.
use super::{
    entries::{Entries, Entry, depth_of},
    folder::{Folder, invalid, parse_matrix, shortened},
    intrinsics::{self, Intrinsics},
    layout::COLOR_ENDS,
};
use mte_slam_types::sequence::SequenceError;

/// ScanNet's table of labels; it lies beside the scenes.
const TABLE: &str = "scannetv2-labels.combined.tsv";
/// The depth camera of most scenes.
const USUAL: [f64; 4] = [577.590698, 578.729797, 318.905426, 242.683609];

/// Reads everything but the images of `color/`, `depth/`, `pose/` and `intrinsic/`.
pub(super) fn read(folder: &Folder) -> Result<Entries, SequenceError> {
    let mut warnings = Vec::new();
    let colors = folder.numbered("color/", &COLOR_ENDS)?;
    let depths = folder.numbered("depth/", &[".png"])?;
    let poses = folder.numbered("pose/", &[".txt"])?;
    let mut frames = Vec::with_capacity(colors.len());
    for (number, color) in colors {
        let depth = depth_of(&depths, number, &color, "depth/")?;
        let truth = match poses.get(&number) {
            Some(file) => parse_matrix(file, Some(number), &folder.text(file)?)?,
            None => None,
        };
        frames.push(Entry::of_files(number, color, depth, truth));
    }
    let intrinsics = match intrinsics::read(folder)? {
        Some(from_file) => from_file,
        None => exported_camera(folder, &frames, &mut warnings)?,
    };
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

/// What ScanNet's raw label ids are in NYU's list of 40 classes.
pub(super) struct RawIds(Vec<u8>);

impl RawIds {
    /// The class 1 to 40, or 0 for an id that has none.
    pub fn nyu40(&self, raw: u16) -> u16 {
        self.0.get(usize::from(raw)).copied().unwrap_or(0).into()
    }
}

/// Reads the table, which may lie in the recording's folder or up to two above.
pub(super) fn raw_ids(folder: &Folder) -> Result<Option<RawIds>, SequenceError> {
    let Some(file) = folder.here_or_above(TABLE) else { return Ok(None) };
    let text = folder.text(&file)?;
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split('\t').map(str::trim).collect();
    let column = |name: &str| {
        head.iter().position(|h| *h == name).ok_or_else(|| {
            let found = shortened(&head.join(" "));
            invalid(TABLE, None, "columns", found, format!("one named {name}, tabs between"))
        })
    };
    let (id, nyu40) = (column("id")?, column("nyu40id")?);
    let mut ids = Vec::new();
    for (i, line) in lines.enumerate().filter(|(_, l)| !l.trim().is_empty()) {
        let cells: Vec<&str> = line.split('\t').map(str::trim).collect();
        let wrong = |expected: &str| {
            let field = format!("line {}", i + 2);
            invalid(TABLE, None, field, shortened(line), expected)
        };
        let raw: u16 = cells
            .get(id)
            .and_then(|c| c.parse().ok())
            .ok_or_else(|| wrong("an id from 0 to 65535 in the column id"))?;
        let class: u8 = match cells.get(nyu40).copied().unwrap_or_default() {
            "" => 0,
            cell => cell
                .parse()
                .ok()
                .filter(|n| *n <= 40)
                .ok_or_else(|| wrong("0 to 40 in the column nyu40id"))?,
        };
        if ids.len() <= usize::from(raw) {
            ids.resize(usize::from(raw) + 1, 0);
        }
        ids[usize::from(raw)] = class;
    }
    Ok(Some(RawIds(ids)))
}
