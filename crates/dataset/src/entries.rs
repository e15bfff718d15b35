//! What each layout boils down to: a list of frames with file names, and a camera.
use super::{
    decode::Size,
    folder::{Folder, invalid, plural},
    frame_camera::{Fit, LEAST_PIXELS},
    intrinsics::Intrinsics,
    pose_text::{lines, parse_line},
    stored::Stored,
};
use glam::DVec3;
use mte_slam_types::{camera::Camera, frame::Bounds, pose::Pose, sequence::SequenceError};
use std::collections::BTreeMap;

/// One frame before its images are decoded.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub number: u64,
    pub time_s: f64,
    pub color: Stored,
    pub depth: Stored,
    pub label: Option<String>,
    pub truth: Option<Pose>,
    /// What the recording device took for the pose.
    pub prior: Option<Pose>,
    /// fx, fy, cx, cy of this frame where the frames' cameras differ \[pixels of the recording's
    /// camera\].
    pub focal_centre: Option<[f64; 4]>,
    /// How images of this frame become those of the recording's camera, where they must.
    pub fit: Option<Fit>,
}

impl Entry {
    /// A frame whose images are files of their own, and that has no time stamp.
    pub fn of_files(number: u64, color: String, depth: String, truth: Option<Pose>) -> Entry {
        let (color, depth) = (color.into(), depth.into());
        Entry::stamped(number, number as f64, color, depth, truth)
    }

    /// A frame with a time stamp \[s\].
    pub fn stamped(
        number: u64,
        time_s: f64,
        color: Stored,
        depth: Stored,
        truth: Option<Pose>,
    ) -> Entry {
        let (label, prior, focal_centre, fit) = (None, None, None, None);
        Entry { number, time_s, color, depth, label, truth, prior, focal_centre, fit }
    }
}

/// Returns the depth image that belongs to a number, or else the name that it would have: frames
/// whose files are missing are left out by the reader, or refused.
pub(super) fn depth_of(
    depths: &BTreeMap<u64, String>,
    number: u64,
    start: &str,
    end: &str,
) -> String {
    let digits = |name: &String| name.len() - start.len() - end.len();
    let width = depths.values().next().map_or(1, digits);
    depths.get(&number).cloned().unwrap_or_else(|| format!("{start}{number:0width$}{end}"))
}

/// A recording before its images are decoded.
pub(super) struct Entries {
    pub frames: Vec<Entry>,
    pub intrinsics: Intrinsics,
    pub depth_unit_m: f64,
    /// A depth value besides 0 that is known to mean "no measurement". 65535 does everywhere.
    pub invalid_depth: Option<u16>,
    pub bounds: Option<Bounds>,
    pub warnings: Vec<String>,
}

impl Entries {
    /// Completes what a layout has read by what any recording may hold or be given beside it.
    pub fn completed(
        mut self,
        folder: &Folder,
        given: Option<&Intrinsics>,
    ) -> Result<Entries, SequenceError> {
        if let Some(given) = given {
            let depth_scale = self.intrinsics.depth_scale;
            self.intrinsics = Intrinsics { depth_scale, ..given.clone() };
            self.frames.iter_mut().for_each(|frame| frame.focal_centre = None);
        }
        if let Some(scale) = self.intrinsics.depth_scale {
            self.depth_unit_m = 1.0 / scale;
        }
        self.bounds = bounds(folder)?;
        let unposed = self.frames.iter().filter(|e| e.truth.is_none()).count();
        if unposed == self.frames.len() {
            self.warnings.push("no ground-truth poses: the trajectory cannot be scored".into());
        } else if unposed > 0 {
            let frames = plural(unposed, "frame");
            self.warnings.push(format!("{frames} without a ground-truth pose: masked in scores"));
        }
        Ok(self)
    }
}

/// Decides which frames must be brought into the common camera, and says it.
pub(super) fn fit_cameras(
    frames: &mut [Entry],
    intrinsics: &Intrinsics,
    common: &Camera,
    size: Size,
    warnings: &mut Vec<String>,
) -> Result<(), SequenceError> {
    let (mut own, mut moved, mut farthest) = (0, 0, 0.0f64);
    for frame in frames.iter_mut() {
        let Some(focal_centre) = frame.focal_centre else { continue };
        let camera = Intrinsics { focal_centre, ..intrinsics.clone() };
        let fit = Fit::new(common, &camera.camera(&frame.depth.file, size)?);
        let pixels = fit.farthest(size);
        own += 1;
        farthest = farthest.max(pixels);
        if pixels >= LEAST_PIXELS {
            moved += 1;
            frame.fit = Some(fit);
        }
    }
    if own > 0 && farthest > 0.0 {
        let what = match moved {
            0 => "the median is taken for all".into(),
            n => format!("{} brought into the median camera", plural(n, "frame")),
        };
        let from = &intrinsics.from;
        warnings.push(format!(
            "{from}: the frames have cameras of their own, which differ from their median by up to \
             {farthest:.2} pixels: {what}"
        ));
    }
    Ok(())
}

/// Reads one pose per line. As many lines as images: line i belongs to the i-th image. More lines (when
/// only some of the images were kept): line n belongs to image number n.
pub(super) fn trajectory(
    folder: &Folder,
    file: &str,
    numbers: &[u64],
) -> Result<Vec<Option<Pose>>, SequenceError> {
    let text = folder.text(file)?;
    let lines = lines(&text);
    let places = places(lines.len(), numbers).ok_or_else(|| {
        invalid(
            file,
            None,
            "poses",
            plural(lines.len(), "line"),
            format!("{}, one for each colour image", plural(numbers.len(), "line")),
        )
    })?;
    let poses = places.zip(numbers);
    poses.map(|(place, number)| parse_line(file, Some(*number), lines[place])).collect()
}

/// Which of `poses` poses belongs to each image; `None` where they do not fit.
pub(super) fn places(poses: usize, numbers: &[u64]) -> Option<impl Iterator<Item = usize>> {
    let by_number = poses != numbers.len();
    let fits = numbers.iter().all(|&number| number < poses as u64);
    let place = move |(i, &number): (usize, &u64)| if by_number { number as usize } else { i };
    (fits || !by_number).then(|| numbers.iter().enumerate().map(place))
}

/// `bound.json`: {"bound": [[x0, x1], [y0, y1], [z0, z1]]}.
fn bounds(folder: &Folder) -> Result<Option<Bounds>, SequenceError> {
    const FILE: &str = "bound.json";
    if !folder.has(FILE) {
        return Ok(None);
    }
    let json = folder.json(FILE)?;
    let number = |axis: usize, side: usize| json.get("bound")?.get(axis)?.get(side)?.as_f64();
    let corner = |side| Some(DVec3::new(number(0, side)?, number(1, side)?, number(2, side)?));
    match (corner(0), corner(1)) {
        (Some(min), Some(max)) if min.cmplt(max).all() && (max - min).is_finite() => {
            Ok(Some(Bounds { min, max }))
        }
        _ => {
            let mut found = json.to_string();
            if let Some((end, _)) = found.char_indices().nth(120) {
                found.truncate(end);
            }
            let expected = r#"{"bound": [[x0, x1], [y0, y1], [z0, z1]]}, each pair ascending"#;
            Err(invalid(FILE, None, "bound", found, expected))
        }
    }
}
