//! What a recording holds, and whether its parts fit each other: the usual mistakes of own
//! recordings show in numbers that anybody can check.
mod agreement;
mod remark;
mod summary;

pub use crate::depth_range::FarDepth;
pub use agreement::{Agreement, PoseReading, Reading};
pub use remark::{Remark, Severity};
pub use summary::{ClassShare, DepthSummary, Gap, Jump, LabelSummary, OrderSummary, PoseSummary};

use crate::depth_range::UNUSUAL_START;
use mte_slam_types::{
    camera::Camera,
    sequence::{Sequence, SequenceError},
};
use serde::Serialize;

/// How many frames are looked at.
#[derive(Clone, Copy, Debug)]
pub struct InspectOptions {
    /// Frames that are decoded for ranges, holes and classes, spread evenly.
    pub frames: usize,
    /// Frames that are re-projected into later ones, spread evenly.
    pub pairs: usize,
}

impl Default for InspectOptions {
    fn default() -> Self {
        Self { frames: 40, pairs: 12 }
    }
}

/// What a recording holds.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// Name of the recording.
    pub name: String,
    /// Its layout.
    pub layout: String,
    /// Number of frames.
    pub frames: usize,
    /// The camera of the images, as they are delivered.
    pub camera: Camera,
    /// Metres per unit of depth.
    pub depth_unit_m: f64,
    /// Frame numbers and time stamps.
    pub order: OrderSummary,
    /// Depth of some frames.
    pub depth: DepthSummary,
    /// Ground-truth poses.
    pub poses: PoseSummary,
    /// Labels of some frames, where there are any.
    pub labels: Option<LabelSummary>,
    /// How well depth and poses fit each other, where the poses allow to say.
    pub agreement: Option<Agreement>,
    /// Evidence of mistakes, the worst first.
    pub remarks: Vec<Remark>,
}

impl Inspection {
    /// Returns whether there is any warning.
    pub fn has_warnings(&self) -> bool {
        self.remarks.iter().any(|r| r.severity == Severity::Warning)
    }
}

/// Looks at a recording. `progress` is called with frames done and to do.
///
/// # Errors
/// When a frame cannot be read.
pub fn inspect(
    sequence: &mut dyn Sequence,
    options: InspectOptions,
    mut progress: impl FnMut(usize, usize),
) -> Result<Inspection, SequenceError> {
    let info = sequence.info().clone();
    let looked_at = spread(info.frames, options.frames);
    let anchors = spread(info.frames, options.pairs);
    let total = looked_at.len() + anchors.len();
    let mut images = summary::Images::new(&info);
    for (i, &index) in looked_at.iter().enumerate() {
        images.add(&sequence.frame(index)?);
        progress(i + 1, total);
    }
    let order = summary::order(sequence);
    let poses = summary::poses(sequence);
    let step = |done| progress(looked_at.len() + done, total);
    let agreement = agreement::measure(sequence, &anchors, step)?;
    let (depth, labels) = images.finish();

    let mut remarks = Vec::new();
    let mut add = |severity, text: String| remarks.push(Remark { severity, text });
    if let Some(agreement) = &agreement {
        agreement.remark(&info, &mut add);
    } else if poses.known > 1 {
        let text = "the camera hardly moves, or no two frames show the same: whether depth and \
                    poses fit each other cannot be said";
        add(Severity::Note, text.into());
    }
    centre_remark(&info.camera, &mut add);
    depth.remark(&info, agreement.is_some(), &mut add);
    poses.remark(&mut add);
    order.remark(&mut add);
    // More frames were looked at for the range here than at opening.
    let of_range = |text: &String| text.starts_with(UNUSUAL_START);
    for text in sequence.warnings().into_iter().filter(|text| !of_range(text)) {
        add(Severity::Note, text);
    }
    remarks.sort_by_key(|r| r.severity != Severity::Warning);
    Ok(Inspection {
        name: info.name,
        layout: info.layout.into(),
        frames: info.frames,
        camera: info.camera,
        depth_unit_m: info.depth_unit_m,
        order,
        depth,
        poses,
        labels,
        agreement,
        remarks,
    })
}

/// A camera of images of another size, such as of larger colour images, shows by its centre.
fn centre_remark(c: &Camera, add: &mut impl FnMut(Severity, String)) {
    let sides = [(c.cx, c.width), (c.cy, c.height)];
    let whole = sides.map(|(centre, side)| (2.0 * centre + 1.0, f64::from(side)));
    if whole.iter().any(|(twice, side)| !(0.75..=1.33).contains(&(twice / side))) {
        let text = format!(
            "the camera's centre, {:.1} {:.1}, is far from the middle of {}x{}: it seems to be that \
             of images of about {:.0}x{:.0}; --camera takes that of the depth images",
            c.cx, c.cy, c.width, c.height, whole[0].0, whole[1].0
        );
        add(Severity::Warning, text);
    }
}

/// At most `wanted` of `0..frames`, evenly spread, with the first.
fn spread(frames: usize, wanted: usize) -> Vec<usize> {
    let n = wanted.min(frames);
    (0..n).map(|i| i * frames / n.max(1)).collect()
}

#[cfg(test)]
mod tests;
