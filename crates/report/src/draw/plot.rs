//! `trajectory.svg`: estimate and truth from above and from the side, axes in metres.
use glam::DVec3;
use std::fmt::Write;

const WIDTH: f64 = 1240.0;
const HEIGHT: f64 = 640.0;
const PANEL: f64 = 500.0;
const TOP: f64 = 84.0;

/// What is drawn.
pub struct Plot<'a> {
    /// First line, for example the sequence's name.
    pub title: &'a str,
    /// Second line, for example the ATE.
    pub subtitle: &'a str,
    /// Estimated camera centres, aligned with the truth where there is one \[m\].
    pub estimate: &'a [DVec3],
    /// For each estimate, whether the frame was lost.
    pub lost: &'a [bool],
    /// True camera centres \[m\].
    pub truth: &'a [DVec3],
    /// Mean upward direction of the camera in the world: decides which axis is the height.
    pub up: DVec3,
}

/// The picture's text.
pub fn svg(plot: &Plot) -> String {
    let mut s = String::new();
    let _ = writeln!(
        s,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" \
         height=\"{HEIGHT}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <text x=\"60\" y=\"30\" font-size=\"18\" font-weight=\"bold\">{}</text>\n\
         <text x=\"60\" y=\"52\" fill=\"#444\">{}</text>",
        escape(plot.title),
        escape(plot.subtitle)
    );
    legend(&mut s, plot);
    // The height is the world axis that the cameras' up direction is closest to.
    let up = plot.up.abs();
    let height = if up.z >= up.x && up.z >= up.y {
        2
    } else if up.y >= up.x {
        1
    } else {
        0
    };
    let [a, b] = match height {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    };
    panel(&mut s, plot, 70.0, "from above", a, b);
    panel(&mut s, plot, 690.0, "from the side", a, height);
    s.push_str("</svg>\n");
    s
}

fn legend(s: &mut String, plot: &Plot) {
    let mut x = 70.0;
    let y = HEIGHT - 12.0;
    let mut item = |mark: &str, text: &str, width: f64| {
        let _ = writeln!(
            s,
            "<g transform=\"translate({x} {y})\">{mark}<text x=\"34\" y=\"0\">{text}</text></g>"
        );
        x += width;
    };
    if !plot.truth.is_empty() {
        let mark = "<path d=\"M0 -4H28\" stroke=\"#9aa0a6\" stroke-width=\"5\"/>";
        item(mark, "truth", 100.0);
    }
    item("<path d=\"M0 -4H28\" stroke=\"#1a56db\" stroke-width=\"2\"/>", "estimate", 120.0);
    item("<circle cx=\"14\" cy=\"-4\" r=\"6\" fill=\"#0f9d58\"/>", "start", 100.0);
    item("<rect x=\"8\" y=\"-10\" width=\"12\" height=\"12\" fill=\"#e37400\"/>", "end", 90.0);
    if plot.lost.contains(&true) {
        item(
            "<path d=\"M9 -9l10 10m0 -10l-10 10\" stroke=\"#d93025\" stroke-width=\"2\"/>",
            "lost",
            90.0,
        );
    }
}

fn panel(s: &mut String, plot: &Plot, left: f64, name: &str, a: usize, b: usize) {
    let axis = ["x", "y", "z"];
    let all: Vec<DVec3> = plot.estimate.iter().chain(plot.truth).copied().collect();
    let range = |k: usize| {
        let (low, high) = all
            .iter()
            .map(|p| p[k])
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low <= high { (low, high) } else { (0.0, 1.0) }
    };
    let (ra, rb) = (range(a), range(b));
    // One scale for both axes, with a margin; at least 1 cm so that a still camera has axes too.
    let span = (ra.1 - ra.0).max(rb.1 - rb.0).max(0.01) * 1.12;
    let centre = (0.5 * (ra.0 + ra.1), 0.5 * (rb.0 + rb.1));
    let scale = PANEL / span;
    let px = |v: f64| left + PANEL / 2.0 + (v - centre.0) * scale;
    let py = |v: f64| TOP + PANEL / 2.0 - (v - centre.1) * scale;
    let _ = writeln!(
        s,
        "<text x=\"{left}\" y=\"{}\" font-weight=\"bold\">{name}</text>\n\
         <rect x=\"{left}\" y=\"{TOP}\" width=\"{PANEL}\" height=\"{PANEL}\" fill=\"none\" stroke=\"#888\"/>",
        TOP - 8.0
    );
    let step = nice_step(span / 6.0);
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let ticks = |middle: f64| {
        let first = ((middle - span / 2.0) / step).ceil() as i64;
        let last = ((middle + span / 2.0) / step).floor() as i64;
        (first..=last).map(move |i| i as f64 * step)
    };
    for v in ticks(centre.0) {
        let _ = writeln!(
            s,
            "<path d=\"M{x:.1} {TOP}v{PANEL}\" stroke=\"#e4e6ea\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{v:.digits$}</text>",
            TOP + PANEL + 17.0,
            x = px(v)
        );
    }
    for v in ticks(centre.1) {
        let _ = writeln!(
            s,
            "<path d=\"M{left} {y:.1}h{PANEL}\" stroke=\"#e4e6ea\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{v:.digits$}</text>",
            left - 6.0,
            py(v) + 4.0,
            y = py(v)
        );
    }
    let _ = writeln!(
        s,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#444\">{} [m]</text>\
         <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#444\">{} [m]</text>",
        left + PANEL - 6.0,
        TOP + PANEL - 8.0,
        axis[a],
        left + 6.0,
        TOP + 16.0,
        axis[b]
    );
    let mut line = |points: &[DVec3], style: &str| {
        let path: Vec<String> = points
            .iter()
            .filter(|p| p.is_finite())
            .map(|p| format!("{:.2},{:.2}", px(p[a]), py(p[b])))
            .collect();
        let _ = writeln!(
            s,
            "<polyline points=\"{}\" fill=\"none\" stroke-linejoin=\"round\" {style}/>",
            path.join(" ")
        );
    };
    if !plot.truth.is_empty() {
        line(plot.truth, "stroke=\"#9aa0a6\" stroke-width=\"5\" opacity=\"0.8\"");
    }
    line(plot.estimate, "stroke=\"#1a56db\" stroke-width=\"1.6\"");
    let shown = |p: &&DVec3| p.is_finite();
    for (p, _) in plot.estimate.iter().zip(plot.lost).filter(|(p, lost)| **lost && p.is_finite()) {
        let _ = writeln!(
            s,
            "<path d=\"M{:.2} {:.2}l8 8m0 -8l-8 8\" stroke=\"#d93025\" stroke-width=\"1.6\"/>",
            px(p[a]) - 4.0,
            py(p[b]) - 4.0
        );
    }
    if let Some(p) = plot.estimate.first().filter(shown) {
        let _ = writeln!(
            s,
            "<circle cx=\"{:.2}\" cy=\"{:.2}\" r=\"6\" fill=\"#0f9d58\"/>",
            px(p[a]),
            py(p[b])
        );
    }
    if let Some(p) = plot.estimate.last().filter(shown) {
        let _ = writeln!(
            s,
            "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"11\" height=\"11\" fill=\"#e37400\"/>",
            px(p[a]) - 5.5,
            py(p[b]) - 5.5
        );
    }
}

/// `anchors.svg`: anchors in use, and how many were spawned, dropped and merged so far, over the
/// calls of the optimisation. `history`: (frame, in use, spawned, dropped, merged).
pub fn anchors_svg(title: &str, history: &[(usize, u32, u32, u32, u32)], limit: u32) -> String {
    let (left, top, width, height) = (70.0, TOP, 1100.0, 440.0);
    let most = history.iter().map(|h| h.2.max(h.1)).max().unwrap_or(0).max(limit).max(1);
    let px = |i: usize| left + width * i as f64 / (history.len().max(2) - 1) as f64;
    let py = |v: u32| top + height * (1.0 - f64::from(v) / f64::from(most));
    let mut s = String::new();
    let _ = writeln!(
        s,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} 600\" width=\"{WIDTH}\" \
         height=\"600\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <text x=\"60\" y=\"30\" font-size=\"18\" font-weight=\"bold\">{}</text>\n\
         <text x=\"60\" y=\"52\" fill=\"#444\">anchors of the redundancy suppressor over the \
         calls of the optimisation</text>\n\
         <rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" \
         stroke=\"#888\"/>\n\
         <path d=\"M{left} {y:.1}h{width}\" stroke=\"#9aa0a6\" stroke-dasharray=\"6 4\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#444\">limit {limit}</text>",
        escape(title),
        left + width - 6.0,
        py(limit) + 16.0,
        y = py(limit),
    );
    let step = nice_step(f64::from(most) / 6.0).max(1.0) as u32;
    for v in (0..=most).step_by(step as usize) {
        let y = py(v);
        let _ = writeln!(
            s,
            "<path d=\"M{left} {y:.1}h{width}\" stroke=\"#e4e6ea\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{v}</text>",
            left - 6.0,
            y + 4.0
        );
    }
    for i in (0..history.len()).step_by(history.len().div_ceil(10).max(1)) {
        let _ = writeln!(
            s,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">frame {}</text>",
            px(i),
            top + height + 17.0,
            history[i].0
        );
    }
    type Column = fn(&(usize, u32, u32, u32, u32)) -> u32;
    let columns: [(&str, &str, Column); 4] = [
        ("in use", "#1a56db", |h| h.1),
        ("spawned", "#0f9d58", |h| h.2),
        ("dropped", "#d93025", |h| h.3),
        ("merged", "#e37400", |h| h.4),
    ];
    for (i, (name, color, value)) in columns.into_iter().enumerate() {
        let path: Vec<String> = history
            .iter()
            .enumerate()
            .map(|(k, h)| format!("{:.1},{:.1}", px(k), py(value(h))))
            .collect();
        let x = left + 140.0 * i as f64;
        let y = top + height + 46.0;
        let _ = writeln!(
            s,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>\
             <path d=\"M{x} {y}h28\" stroke=\"{color}\" stroke-width=\"3\"/>\
             <text x=\"{}\" y=\"{}\">{name}</text>",
            path.join(" "),
            x + 34.0,
            y + 4.0
        );
    }
    s.push_str("</svg>\n");
    s
}

/// The largest of 1, 2, 5 times a power of ten that is not above `rough` by more than half.
pub fn nice_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    let m = rough / power;
    power
        * if m < 1.5 {
            1.0
        } else if m < 3.5 {
            2.0
        } else if m < 7.5 {
            5.0
        } else {
            10.0
        }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_inputs_give_finite_pictures() {
        let nan = [DVec3::splat(f64::NAN), DVec3::ONE];
        let cases: [(&[DVec3], &[DVec3]); 4] =
            [(&[], &[]), (&[DVec3::ZERO], &[]), (&nan, &[DVec3::ZERO]), (&nan[..1], &[])];
        for (estimate, truth) in cases {
            let lost = vec![true; estimate.len()];
            let (title, subtitle) = ("a<b & c", "");
            let text = svg(&Plot { title, subtitle, estimate, lost: &lost, truth, up: DVec3::Z });
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
            assert!(text.contains("a&lt;b &amp; c") && text.ends_with("</svg>\n"));
        }
    }

    #[test]
    fn steps_are_round() {
        assert_eq!([0.13, 0.3, 0.6, 0.9].map(nice_step), [0.1, 0.2, 0.5, 1.0]);
    }
}
