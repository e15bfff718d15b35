//! The table that people read at the end of a run.
use crate::{
    metrics::{ClassFigures, Metrics, SemanticFigures},
    timings::Spread,
};
use mte_slam_metrics::{DepthReport, SurfaceReport};
use std::fmt::Write;

impl SemanticFigures {
    /// Rows of the table, their names after `prefix`.
    fn rows(&self, prefix: &str) -> Vec<(String, String)> {
        let r = &self.report;
        let mut rows = vec![
            ("mIoU".to_owned(), format!("{:.2} %", r.miou_percent)),
            ("pixel accuracy".to_owned(), format!("{:.2} %", r.pixel_accuracy_percent)),
        ];
        if let Some(small) = r.small_miou_percent {
            let n = r.small_classes.len();
            let name = format!("mIoU of {n} classes < {} %", self.small_share_percent);
            rows.push((name, format!("{small:.2} %")));
        }
        if let Some(b) = &r.boundary {
            let both = format!("{:.2}, {:.2} %", b.iou_percent, b.f_score_percent);
            rows.push(("boundary IoU, F-score".to_owned(), both));
        }
        rows.into_iter().map(|(name, value)| (format!("{prefix}{name}"), value)).collect()
    }

    /// One line per class, most frequent first; beside the IoU that of the `input` labels.
    fn class_table(&self, input: Option<&SemanticFigures>) -> String {
        let mut classes: Vec<&ClassFigures> = self.classes.iter().collect();
        classes.sort_by_key(|c| std::cmp::Reverse(c.pixels));
        let width = classes.iter().map(|c| c.name.chars().count()).max().unwrap_or(0).max(5);
        let figure = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{v:.1}"));
        let mut text = format!(
            "{:width$}  {:>5}  {:>8}  {:>6}{}  {:>8}  {:>12}  {:>7}\n",
            "class",
            "id",
            "pixels %",
            "IoU %",
            if input.is_some() { "   input" } else { "" },
            "accuracy",
            "boundary IoU",
            "F-score"
        );
        for c in classes {
            let of_input = input.map_or(String::new(), |i| {
                let same = i.classes.iter().find(|other| other.id == c.id);
                format!("  {:>6}", figure(same.map(|s| s.iou_percent)))
            });
            let share = 100.0 * c.pixels as f64 / self.report.pixels as f64;
            let _ = writeln!(
                text,
                "{:width$}  {:>5}  {share:>8.2}  {:>6.1}{of_input}  {:>8}  {:>12}  {:>7}",
                c.name,
                c.id,
                c.iou_percent,
                figure(c.accuracy_percent),
                figure(c.boundary_iou_percent),
                figure(c.boundary_f_score_percent)
            );
        }
        text
    }
}

impl Metrics {
    /// The table for people.
    pub fn table(&self) -> String {
        let mut rows: Vec<(String, String, &str)> = Vec::new();
        let mut row = |name: &str, value: String, protocol| {
            rows.push((name.to_owned(), value, protocol));
        };
        if let Some(t) = &self.trajectory {
            row("ATE RMSE, aligned", format!("{:.3} cm", t.aligned_cm.rmse), &t.protocol);
            row("ATE RMSE, unaligned", format!("{:.3} cm", t.unaligned_cm.rmse), "");
        }
        if let Some(t) = &self.trajectory_without_lost {
            row("ATE RMSE, aligned, not lost", format!("{:.3} cm", t.aligned_cm.rmse), "");
        }
        if let Some(d) = &self.depth {
            row("depth L1, views", format!("{:.2} cm", d.l1_cm), &d.protocol);
            row("depth bias, coverage", depth_detail(d), "");
        }
        if let Some(c) = &self.color {
            row("PSNR, views", format!("{:.2} dB", c.mean_of_psnr_db), &c.protocol);
        }
        if let Some(s) = &self.semantics {
            let boundary = s.report.boundary.as_ref();
            for (i, (name, value)) in s.rows("").into_iter().enumerate() {
                let protocol = match i {
                    0 => s.report.protocol.as_str(),
                    _ if name.starts_with("boundary") => boundary.map_or("", |b| &b.protocol),
                    _ => "",
                };
                row(&name, value, protocol);
            }
        }
        if let Some(s) = &self.semantics_sni {
            let value = format!("{:.2}, {:.2} %", s.miou_percent, s.pixel_accuracy_percent);
            row("SNI-SLAM's mIoU, pixels", value, s.protocol.sentence());
        }
        if let Some(s) = &self.semantics_by_inference {
            let r = &s.semantics.report;
            let of_true = r.miou_of_true_classes_percent;
            row(
                &format!("by {}: mIoU, of true classes", s.inference),
                format!("{:.2}, {of_true:.2} %", r.miou_percent),
                "the same frames rendered again",
            );
            let pixels = format!("{:.2} %", r.pixel_accuracy_percent);
            row(&format!("by {}: pixel accuracy", s.inference), pixels, "");
        }
        if let Some(n) = &self.novel_views {
            if let Some(s) = &n.semantics {
                row("novel views: mIoU", format!("{:.2} %", s.report.miou_percent), &n.protocol);
                let pixels = format!("{:.2} %", s.report.pixel_accuracy_percent);
                row("novel views: pixel accuracy", pixels, "");
            }
            let protocol = if n.semantics.is_none() { n.protocol.as_str() } else { "" };
            if let Some(d) = &n.depth {
                row("novel views: depth L1, views", format!("{:.2} cm", d.l1_cm), protocol);
            }
            if let Some(c) = &n.color {
                row("novel views: PSNR", format!("{:.2} dB", c.mean_of_psnr_db), "");
            }
        }
        if let Some(s) = &self.input_labels {
            for (i, (name, value)) in s.rows("input labels: ").into_iter().enumerate() {
                let protocol = "the labels that the map learnt from, in the rendered frames";
                row(&name, value, if i == 0 { protocol } else { "" });
            }
        }
        if let Some(c) = &self.class_changes {
            let next = "of surface points, from one rendered frame to the next";
            row("classes that change", format!("{:.2} %", c.changed_percent), next);
            if let Some(c) = &self.input_class_changes {
                row("labels that change", format!("{:.2} %", c.changed_percent), "");
            }
        }
        for (how, report) in
            [("Co-SLAM", &self.mesh_coslam), ("ESLAM", &self.mesh), ("frustum", &self.mesh_frustum)]
        {
            let Some(m) = report else { continue };
            for (i, (name, value)) in surface_rows(m).into_iter().enumerate() {
                row(&format!("{name} ({how})"), value, if i == 0 { &m.protocol } else { "" });
            }
        }
        if let Some(d) = &self.mesh_depth {
            row("depth L1, mesh", format!("{:.2} cm", d.l1_cm), &d.protocol);
            let both = format!("{:.2} cm, {:.1} %", d.l1_of_both_cm, d.missing_percent);
            row("where both are, mesh missing", both, "");
        }
        if let Some(t) = &self.time {
            let of = |s: &Spread| format!("{:.3} s (p95 {:.3})", s.median_s, s.p95_s);
            row("tracking per frame", of(&t.tracking), t.protocol.sentence());
            row("mapping per mapped frame", of(&t.mapping), "");
            row("total per frame", of(&t.total), "");
            row("last optimisation", format!("{:.1} s", t.last_optimisation_s), "");
            row("whole program", format!("{:.1} s", t.wall_s), "");
        }
        if let Some(m) = &self.memory {
            let mib = |b: u64| format!("{:.0} MiB", b as f64 / f64::from(1 << 20));
            let host = m.peak_host_bytes.map_or("unknown".to_owned(), mib);
            row("peak host memory", host, m.protocol.sentence());
            row("peak device buffers", mib(m.peak_device_bytes), "");
        }
        row("lost frames", lost_text(&self.lost_frames), "");
        let name_width = rows.iter().map(|r| r.0.len()).max().unwrap_or(0);
        let mut text = String::new();
        // Protocols are long: numbered, and listed below the figures they belong to.
        let mut protocols = Vec::new();
        for (name, value, protocol) in rows {
            let mut line = format!("{name:name_width$}  {value:26}");
            if !protocol.is_empty() {
                protocols.push(protocol);
                line += &format!("  [{}]", protocols.len());
            }
            let _ = writeln!(text, "{}", line.trim_end());
        }
        for (i, protocol) in protocols.iter().enumerate() {
            let _ = writeln!(text, "{}", wrapped(&format!("[{}] {protocol}", i + 1)));
        }
        if let Some(s) = &self.semantics {
            text += "\n";
            text += &s.class_table(self.input_labels.as_ref());
            text += "\n";
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "note: {warning}");
        }
        for (section, reason) in &self.absent {
            let _ = writeln!(text, "no {section}: {reason}");
        }
        text
    }
}

/// Lines of at most 96 characters; later ones indented.
fn wrapped(text: &str) -> String {
    let mut lines = String::new();
    let mut length = 0;
    for word in text.split(' ') {
        if length > 0 && length + 1 + word.len() > 96 {
            lines += "\n   ";
            length = 3;
        }
        if length > 0 {
            lines.push(' ');
            length += 1;
        }
        lines += word;
        length += word.len();
    }
    lines
}

/// Figures of a mesh, the peers' first.
fn surface_rows(m: &SurfaceReport) -> Vec<(&'static str, String)> {
    let (p, s) = (&m.point_to_point, &m.point_to_surface);
    let pair = |a: f64, b: f64| format!("{a:.2}, {b:.2} cm");
    vec![
        ("mesh accuracy, completion", pair(p.accuracy_cm, p.completion_cm)),
        ("completion ratio", format!("{:.1} %", p.completion_ratio_percent)),
        ("floor by sampling alone", format!("{:.2} cm", m.sampling_floor_cm)),
        ("exact, to the surface", pair(s.accuracy_cm, s.completion_cm)),
        ("exact completion ratio", format!("{:.1} %", s.completion_ratio_percent)),
    ]
}

fn depth_detail(d: &DepthReport) -> String {
    format!("{:+.2} cm, {:.1} %", d.bias_cm, 100.0 * d.coverage)
}

fn lost_text(lost: &[usize]) -> String {
    if lost.is_empty() {
        return "none".to_owned();
    }
    let shown: Vec<String> = lost.iter().take(12).map(usize::to_string).collect();
    let more = if lost.len() > shown.len() { ", ..." } else { "" };
    format!("{} ({}{more})", lost.len(), shown.join(", "))
}
