//! Counts and ranges.
use super::remark::Severity;
use crate::depth_range::{FarDepth, Histogram, unusual};
use mte_slam_types::{
    classes::UNLABELLED,
    frame::{Frame, SequenceInfo},
    sequence::Sequence,
};
use serde::Serialize;

/// Gaps that are listed one by one.
const LISTED: usize = 5;

/// Frames from one number to another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gap {
    /// First frame number.
    pub first: u64,
    /// Last frame number.
    pub last: u64,
}

/// Frame numbers and time stamps.
#[derive(Clone, Debug, Serialize)]
pub struct OrderSummary {
    /// First frame number.
    pub first: u64,
    /// Last frame number.
    pub last: u64,
    /// Numbers that are left out between frames, against the usual step.
    pub missing: Vec<Gap>,
    /// Usual time between frames \[s\] (1 where frames are only numbered).
    pub median_step_s: f64,
    /// Longest time between frames \[s\].
    pub longest_step_s: f64,
}

/// Depth of the frames looked at.
#[derive(Clone, Debug, Serialize)]
pub struct DepthSummary {
    /// Frames looked at.
    pub frames: usize,
    /// Smallest measured depth \[m\].
    pub min_m: f64,
    /// One in a hundred is nearer \[m\].
    pub percentile_1_m: f64,
    /// Half is nearer \[m\].
    pub median_m: f64,
    /// One in a hundred is farther \[m\].
    pub percentile_99_m: f64,
    /// Largest measured depth \[m\].
    pub max_m: f64,
    /// Share of the pixels without a measurement.
    pub holes: f64,
    /// Frames without any measurement, of those looked at.
    pub empty_frames: usize,
    /// Share of the measured pixels that have the largest value of their format.
    pub saturated: f64,
    /// Depth that lies far beyond the rest, where some does.
    pub far: Option<FarDepth>,
}

/// A step between two frames that is far larger than usual.
#[derive(Clone, Debug, Serialize)]
pub struct Jump {
    /// Number of the frame after it.
    pub frame: u64,
    /// How far \[m\].
    pub step_m: f64,
}

/// Ground-truth poses.
#[derive(Clone, Debug, Serialize)]
pub struct PoseSummary {
    /// Frames with a pose.
    pub known: usize,
    /// Frames without one, as far as others have one.
    pub gaps: Vec<Gap>,
    /// Length of the path \[m\].
    pub path_m: f64,
    /// Usual step between frames \[m\].
    pub median_step_m: f64,
    /// Steps far above it.
    pub jumps: Vec<Jump>,
}

/// A class and how much of the labelled pixels shows it.
#[derive(Clone, Debug, Serialize)]
pub struct ClassShare {
    /// Id in the label images (after ScanNet's are translated).
    pub id: u16,
    /// Name.
    pub name: String,
    /// Share of the labelled pixels.
    pub share: f64,
}

/// Labels of the frames looked at.
#[derive(Clone, Debug, Serialize)]
pub struct LabelSummary {
    /// Frames with labels, of those looked at.
    pub frames: usize,
    /// Classes in the list.
    pub classes: usize,
    /// Share of the pixels with a class.
    pub labelled: f64,
    /// Those that occur, the largest first.
    pub present: Vec<ClassShare>,
}

/// Counts over frames.
pub(super) struct Images {
    info: SequenceInfo,
    frames: usize,
    empty: usize,
    depth: Histogram,
    labelled_frames: usize,
    classes: Vec<u64>,
}

impl Images {
    pub fn new(info: &SequenceInfo) -> Self {
        let (depth, classes) = (Histogram::default(), vec![0; 256]);
        Self { info: info.clone(), frames: 0, empty: 0, depth, labelled_frames: 0, classes }
    }

    pub fn add(&mut self, frame: &Frame) {
        self.frames += 1;
        self.empty += usize::from(frame.depth.iter().all(|d| *d == 0));
        self.depth.add(&frame.depth);
        if let Some(labels) = &frame.labels {
            self.labelled_frames += 1;
            labels.iter().for_each(|l| self.classes[usize::from(*l)] += 1);
        }
    }

    pub fn finish(self) -> (DepthSummary, Option<LabelSummary>) {
        let unit = self.info.depth_unit_m;
        let (all, measured) = (self.depth.pixels(), self.depth.measured());
        let share = |n: u64, of: u64| if of > 0 { n as f64 / of as f64 } else { 0.0 };
        let quantile = |q: f64| f64::from(self.depth.quantile(q)) * unit;
        let depth = DepthSummary {
            frames: self.frames,
            min_m: quantile(0.0),
            percentile_1_m: quantile(0.01),
            median_m: quantile(0.5),
            percentile_99_m: quantile(0.99),
            max_m: quantile(1.0),
            holes: share(self.depth.count(0), all),
            empty_frames: self.empty,
            saturated: share(self.depth.count(u16::MAX), measured),
            far: self.depth.far(unit),
        };
        if self.labelled_frames == 0 {
            return (depth, None);
        }
        let all: u64 = self.classes.iter().sum();
        let labelled = all - self.classes[usize::from(UNLABELLED)];
        let listed = self.info.classes.classes.iter().zip(&self.classes);
        let mut present: Vec<ClassShare> = listed
            .filter(|(_, n)| **n > 0)
            .map(|(class, n)| ClassShare {
                id: class.raw_id,
                name: class.name.clone(),
                share: share(*n, labelled),
            })
            .collect();
        present.sort_by(|a, b| b.share.total_cmp(&a.share));
        let labels = LabelSummary {
            frames: self.labelled_frames,
            classes: self.info.classes.len(),
            labelled: share(labelled, all),
            present,
        };
        (depth, Some(labels))
    }
}

impl DepthSummary {
    /// Ranges that no room has. Where poses tell about the scale this only adds to them.
    pub(super) fn remark(
        &self,
        info: &SequenceInfo,
        measured_by_poses: bool,
        add: &mut impl FnMut(Severity, String),
    ) {
        let units = 1.0 / info.depth_unit_m;
        let (low, median) = (self.percentile_1_m, self.median_m);
        if let Some(text) = unusual(median, info.depth_unit_m) {
            add(if measured_by_poses { Severity::Note } else { Severity::Warning }, text);
        }
        if let Some(FarDepth { limit_m, share }) = self.far {
            let text = format!(
                "{:.1} % of the depth lies beyond {limit_m} m (up to {:.1} m), far from the rest, \
                 half of which is below {median:.2} m: if it is noise, --max-depth {limit_m} leaves \
                 it out",
                100.0 * share,
                self.max_m
            );
            add(Severity::Note, text);
        }
        if self.saturated > 0.02 {
            let text = format!(
                "{:.0} % of the measured depth is 65535, {:.2} m: perhaps it means that nothing was \
                 measured",
                100.0 * self.saturated,
                65535.0 / units
            );
            add(Severity::Warning, text);
        }
        if self.holes > 0.7 {
            let text = format!("{:.0} % of the pixels have no depth", 100.0 * self.holes);
            add(Severity::Warning, text);
        }
        if self.empty_frames > 0 {
            let (n, of) = (self.empty_frames, self.frames);
            add(Severity::Note, format!("{n} of the {of} frames looked at have no depth at all"));
        }
        if low > 0.0 && low < 0.05 && median >= 0.15 {
            let text = format!("1 % of the depth is nearer than {low:.3} m: noise, or no depth");
            add(Severity::Note, text);
        }
    }
}

/// Frame numbers and stamps.
pub(super) fn order(sequence: &dyn Sequence) -> OrderSummary {
    let frames = sequence.info().frames;
    let numbers: Vec<u64> = (0..frames).map(|i| sequence.number(i)).collect();
    let steps: Vec<u64> = numbers.windows(2).map(|w| w[1].saturating_sub(w[0])).collect();
    let usual = median(steps.iter().map(|s| *s as f64).collect()).max(1.0) as u64;
    let missing = numbers.windows(2).filter(|w| w[1].saturating_sub(w[0]) > usual);
    let missing = missing.map(|w| Gap { first: w[0] + usual, last: w[1] - 1 }).collect();
    let times: Vec<f64> = (0..frames).map(|i| sequence.time_s(i)).collect();
    let steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    OrderSummary {
        first: numbers.first().copied().unwrap_or(0),
        last: numbers.last().copied().unwrap_or(0),
        missing,
        longest_step_s: steps.iter().copied().fold(0.0, f64::max),
        median_step_s: median(steps),
    }
}

impl OrderSummary {
    pub(super) fn remark(&self, add: &mut impl FnMut(Severity, String)) {
        if !self.missing.is_empty() {
            let gaps = listed(&self.missing);
            add(Severity::Note, format!("frame numbers are left out: {gaps}"));
        }
        if self.longest_step_s > 5.0 * self.median_step_s.max(0.2) {
            let text = format!(
                "{:.1} s pass between two frames, usually {:.3} s",
                self.longest_step_s, self.median_step_s
            );
            add(Severity::Note, text);
        }
    }
}

/// Ground truth, frame by frame.
pub(super) fn poses(sequence: &dyn Sequence) -> PoseSummary {
    let frames = sequence.info().frames;
    let known: Vec<usize> = (0..frames).filter(|&i| sequence.truth(i).is_some()).collect();
    let mut gaps: Vec<Gap> = Vec::new();
    if !known.is_empty() {
        let mut open: Option<usize> = None;
        for i in 0..=frames {
            let missing = i < frames && sequence.truth(i).is_none();
            match (open, missing) {
                (None, true) => open = Some(i),
                (Some(from), false) => {
                    let (first, last) = (sequence.number(from), sequence.number(i - 1));
                    gaps.push(Gap { first, last });
                    open = None;
                }
                _ => {}
            }
        }
    }
    let step = |i: usize| {
        let (a, b) = (sequence.truth(i)?, sequence.truth(i + 1)?);
        Some(((b.translation - a.translation).length(), sequence.number(i + 1)))
    };
    let steps: Vec<(f64, u64)> = (0..frames.saturating_sub(1)).filter_map(step).collect();
    let median_step_m = median(steps.iter().map(|s| s.0).collect());
    let far = (10.0 * median_step_m).max(0.2);
    let jumps = steps.iter().filter(|s| s.0 > far);
    let jumps = jumps.map(|&(step_m, frame)| Jump { frame, step_m }).collect();
    let path_m = steps.iter().map(|s| s.0).sum();
    PoseSummary { known: known.len(), gaps, path_m, median_step_m, jumps }
}

impl PoseSummary {
    pub(super) fn remark(&self, add: &mut impl FnMut(Severity, String)) {
        if !self.gaps.is_empty() {
            let gaps = listed(&self.gaps);
            add(Severity::Note, format!("no true pose for the frames {gaps}"));
        }
        if let Some(worst) = self.jumps.iter().max_by(|a, b| a.step_m.total_cmp(&b.step_m)) {
            let text = format!(
                "the true poses jump {} times, by {:.2} m before frame {} (usual step {:.3} m)",
                self.jumps.len(),
                worst.step_m,
                worst.frame,
                self.median_step_m
            );
            add(Severity::Warning, text);
        }
    }
}

fn listed(gaps: &[Gap]) -> String {
    let one = |g: &Gap| match g.first == g.last {
        true => g.first.to_string(),
        false => format!("{}-{}", g.first, g.last),
    };
    let shown: Vec<String> = gaps.iter().take(LISTED).map(one).collect();
    let more = gaps.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    shown.join(", ") + &more
}

/// Returns the median, 0 of nothing.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
