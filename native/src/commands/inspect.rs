//! `mte-slam inspect`.
use crate::{args::InspectArgs, input, screen::Screen};
use anyhow::{Context, Result, bail};
use mte_slam_dataset::inspect::{
    DepthSummary, InspectOptions, Inspection, LabelSummary, PoseSummary, Severity, inspect,
};
use std::fmt::Write;

/// Classes that are listed; the rest is counted.
const LISTED_CLASSES: usize = 8;

/// Looks at a recording and say what is there.
pub fn run(args: &InspectArgs, screen: Screen) -> Result<()> {
    let mut sequence = input::open(&args.dataset, &args.selection, screen)?;
    let options = InspectOptions { frames: args.look_at, pairs: args.pairs };
    let mut progress: Option<crate::progress::Progress> = None;
    let found = inspect(sequence.as_mut(), options, |done, total| {
        let shown = progress.get_or_insert_with(|| screen.progress("looking at frames", total));
        shown.set(done as u64, String::new);
    })
    .with_context(|| args.dataset.display().to_string())?;
    if let Some(progress) = progress {
        progress.finish();
    }
    let json = serde_json::to_string_pretty(&found).context("the findings as JSON")?;
    screen.result(&text(&found), &format!("{json}\n"));
    if args.strict && found.has_warnings() {
        bail!("{}: found warnings, expected none (--strict)", args.dataset.display());
    }
    Ok(())
}

fn text(found: &Inspection) -> String {
    let mut out = String::new();
    let c = &found.camera;
    let mut line = |name: &str, value: String| {
        let _ = writeln!(out, "{name:<9}{value}");
    };
    line("name", found.name.clone());
    line("layout", found.layout.clone());
    let (order, n) = (&found.order, found.frames);
    line("frames", format!("{n}, numbers {} to {}", order.first, order.last));
    line(
        "camera",
        format!(
            "{}x{}, fx {:.2} fy {:.2} cx {:.2} cy {:.2}",
            c.width, c.height, c.fx, c.fy, c.cx, c.cy
        ),
    );
    line("depth", depth(&found.depth, found.depth_unit_m));
    line("poses", poses(&found.poses, n));
    line("labels", found.labels.as_ref().map_or("none".into(), labels));
    let agreement = match &found.agreement {
        None => "cannot be said without true poses and motion".to_owned(),
        Some(a) => format!(
            "depth moved by the true poses misses the measured depth by {:.2} % ({:.1} % if the \
             camera stood still; {} pairs of frames); best with depth times {:.3}: {:.2} %",
            100.0 * a.error,
            100.0 * a.error_without_motion,
            a.pairs,
            a.best_factor,
            100.0 * a.best_factor_error
        ),
    };
    line("fit", agreement);
    if found.remarks.is_empty() {
        line("", "nothing to remark".into());
    }
    for remark in &found.remarks {
        let kind = match remark.severity {
            Severity::Warning => "WARNING",
            Severity::Note => "note",
        };
        line(kind, remark.text.clone());
    }
    out
}

fn depth(d: &DepthSummary, unit_m: f64) -> String {
    format!(
        "{:.2} to {:.2} m (98 % in {:.2} to {:.2}, half below {:.2}), {:.1} % holes, {} units per \
         metre; {} frames looked at",
        d.min_m,
        d.max_m,
        d.percentile_1_m,
        d.percentile_99_m,
        d.median_m,
        100.0 * d.holes,
        (1e6 / unit_m).round() / 1e6,
        d.frames
    )
}

fn poses(p: &PoseSummary, frames: usize) -> String {
    match p.known {
        0 => "none".into(),
        known => format!(
            "{known} of {frames}, a path of {:.2} m, {:.1} mm a step",
            p.path_m,
            1000.0 * p.median_step_m
        ),
    }
}

fn labels(l: &LabelSummary) -> String {
    let shown: Vec<String> = l
        .present
        .iter()
        .take(LISTED_CLASSES)
        .map(|c| format!("{} {:.0} %", c.name, 100.0 * c.share))
        .collect();
    let more = l.present.len().saturating_sub(shown.len());
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!(
        "{} of {} classes occur, {:.0} % of the pixels have one: {}{more}",
        l.present.len(),
        l.classes,
        100.0 * l.labelled,
        shown.join(", ")
    )
}
