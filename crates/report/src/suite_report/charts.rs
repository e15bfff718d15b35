//! Charts as SVG, in the page's colours: classes `s0`, `s1`, ... for series, `axis`, `grid`, `truth`.
use super::document::escape;
use crate::draw::plot::nice_step;
use glam::DVec3;
use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 40.0;
/// Points per line, at most: a pixel or two apart.
const POINTS: usize = 500;
/// Letters of a bar's name, at most.
const NAME: usize = 34;
/// Colours before they repeat.
pub const COLORS: usize = 6;

/// A line, y over x.
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Colour.
    pub color: usize,
    /// Points.
    pub points: Vec<(f64, f64)>,
}

/// Lines over a common axis; both axes start at 0.
pub fn lines(x_label: &str, y_label: &str, series: &[Series]) -> String {
    let shown: Vec<(&Series, Vec<(f64, f64)>)> =
        series.iter().map(|s| (s, thinned(&s.points))).collect();
    let all = || shown.iter().flat_map(|(_, p)| p).filter(|p| p.0.is_finite() && p.1.is_finite());
    let x_most = all().map(|p| p.0).fold(0.0, f64::max).max(1e-9);
    let y_most = all().map(|p| p.1).fold(0.0, f64::max).max(1e-9) * 1.05;
    let px = |x: f64| LEFT + (WIDTH - LEFT - RIGHT) * x / x_most;
    let py = |y: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * y / y_most;
    let mut s = open(WIDTH, HEIGHT);
    let step = nice_step(y_most / 5.0);
    for y in ticks(y_most, step) {
        grid_line(&mut s, (LEFT, py(y)), (WIDTH - RIGHT, py(y)));
        text(&mut s, LEFT - 6.0, py(y) + 4.0, "end", &number(y, step));
    }
    let step = nice_step(x_most / 8.0);
    for x in ticks(x_most, step) {
        grid_line(&mut s, (px(x), TOP), (px(x), HEIGHT - BOTTOM));
        text(&mut s, px(x), HEIGHT - BOTTOM + 16.0, "middle", &number(x, step));
    }
    text(&mut s, WIDTH - RIGHT, HEIGHT - 6.0, "end", x_label);
    text(&mut s, LEFT, TOP - 12.0, "start", y_label);
    for (series, points) in &shown {
        polyline(&mut s, points.iter().map(|p| (px(p.0), py(p.1))), series.color, 1.5);
    }
    let entries: Vec<(&str, usize)> = series.iter().map(|s| (s.name.as_str(), s.color)).collect();
    legend(&mut s, WIDTH - RIGHT, TOP - 12.0, &entries);
    s + "</svg>"
}

/// At most [`POINTS`] points; of those between two the one with the largest y, so that no peak is
/// lost.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let step = points.len().div_ceil(POINTS).max(1);
    let largest = |chunk: &[(f64, f64)]| chunk.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    points.chunks(step).filter_map(largest).collect()
}

/// A path in space.
pub struct Path {
    /// Its name in the legend.
    pub name: String,
    /// Colour; none for the truth.
    pub color: Option<usize>,
    /// Positions \[m\].
    pub points: Vec<DVec3>,
}

/// Paths from above and from the side; `up` is the mean upward direction of the cameras.
pub fn paths(paths: &[Path], up: DVec3) -> String {
    // The height is the world axis that the cameras' up direction is closest to.
    let up = up.abs();
    let height = (0..3).max_by(|a, b| up[*a].total_cmp(&up[*b])).unwrap_or(1);
    let [a, b] = match height {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    };
    let mut s = open(WIDTH, 344.0);
    panel(&mut s, paths, 44.0, "from above", (a, b));
    panel(&mut s, paths, 366.0, "from the side", (a, height));
    let entries: Vec<(&str, usize)> =
        paths.iter().map(|p| (p.name.as_str(), p.color.unwrap_or(usize::MAX))).collect();
    legend(&mut s, WIDTH - RIGHT, 338.0, &entries);
    s + "</svg>"
}

fn panel(s: &mut String, paths: &[Path], left: f64, name: &str, (a, b): (usize, usize)) {
    let (top, size) = (24.0, 264.0);
    let range = |k: usize| {
        let values = paths.iter().flat_map(|p| &p.points).map(|p| p[k]).filter(|v| v.is_finite());
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (f64::min(l, v), f64::max(h, v)));
        if low <= high { (low, high) } else { (0.0, 1.0) }
    };
    let (ra, rb) = (range(a), range(b));
    // One scale for both axes; at least 1 cm so that a still camera has axes too.
    let span = (ra.1 - ra.0).max(rb.1 - rb.0).max(0.01) * 1.1;
    let centre = (0.5 * (ra.0 + ra.1), 0.5 * (rb.0 + rb.1));
    let px = |v: f64| left + size * (0.5 + (v - centre.0) / span);
    let py = |v: f64| top + size * (0.5 - (v - centre.1) / span);
    let axis = ["x", "y", "z"];
    text(s, left, top - 8.0, "start", &format!("{name}: {} over {} [m]", axis[b], axis[a]));
    let step = nice_step(span / 4.0);
    let marks = |centre: f64| {
        let first = ((centre - span / 2.0) / step).ceil() as i64;
        let last = ((centre + span / 2.0) / step).floor() as i64;
        (first..=last).map(move |i| i as f64 * step)
    };
    for v in marks(centre.0) {
        grid_line(s, (px(v), top), (px(v), top + size));
        text(s, px(v), top + size + 16.0, "middle", &number(v, step));
    }
    for v in marks(centre.1) {
        grid_line(s, (left, py(v)), (left + size, py(v)));
        text(s, left - 5.0, py(v) + 4.0, "end", &number(v, step));
    }
    for path in paths {
        let step = path.points.len().div_ceil(POINTS).max(1);
        let points = path.points.iter().step_by(step).map(|p| (px(p[a]), py(p[b])));
        match path.color {
            Some(color) => polyline(s, points, color, 1.4),
            None => polyline(s, points, usize::MAX, 4.0),
        }
    }
}

/// One bar, in parts.
pub struct Bar {
    /// What it stands for.
    pub name: String,
    /// Length of each part.
    pub parts: Vec<f64>,
}

/// Bars below each other, all with the same named parts.
pub fn bars(unit: &str, parts: &[&str], bars: &[Bar]) -> String {
    let longest = bars.iter().map(|b| b.name.chars().count().min(NAME)).max().unwrap_or(0);
    let left = 16.0 + 6.6 * longest as f64;
    let row = 22.0;
    let height = TOP + row * bars.len() as f64 + BOTTOM;
    let most =
        bars.iter().map(|b| b.parts.iter().sum::<f64>()).fold(0.0, f64::max).max(1e-9) * 1.08;
    let px = |v: f64| left + (WIDTH - left - RIGHT - 20.0) * v / most;
    let mut s = open(WIDTH, height);
    let step = nice_step(most / 6.0);
    for x in ticks(most, step) {
        grid_line(&mut s, (px(x), TOP), (px(x), height - BOTTOM));
        text(&mut s, px(x), height - BOTTOM + 16.0, "middle", &number(x, step));
    }
    text(&mut s, WIDTH - RIGHT, height - 6.0, "end", unit);
    for (i, bar) in bars.iter().enumerate() {
        let y = TOP + row * i as f64;
        text(&mut s, left - 8.0, y + 15.0, "end", &shortened(&bar.name, NAME));
        let mut from = 0.0;
        for (k, part) in bar.parts.iter().enumerate() {
            let _ = write!(
                s,
                "<rect class=\"f{}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                k % COLORS,
                px(from),
                y + 3.0,
                (px(from + part) - px(from)).max(0.0),
                row - 6.0
            );
            from += part;
        }
        text(&mut s, px(from) + 5.0, y + 15.0, "start", &number(from, step / 10.0));
    }
    let entries: Vec<(&str, usize)> = parts.iter().enumerate().map(|(i, p)| (*p, i)).collect();
    legend(&mut s, WIDTH - RIGHT, TOP - 12.0, &entries);
    s + "</svg>"
}

fn open(width: f64, height: f64) -> String {
    format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\">")
}

fn grid_line(s: &mut String, from: (f64, f64), to: (f64, f64)) {
    let _ = write!(
        s,
        "<path class=\"grid\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>",
        from.0, from.1, to.0, to.1
    );
}

fn text(s: &mut String, x: f64, y: f64, anchor: &str, text: &str) {
    let text = escape(text);
    let _ = write!(s, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
}

/// Parts between points that are no numbers are lines of their own.
fn polyline(s: &mut String, points: impl Iterator<Item = (f64, f64)>, color: usize, width: f64) {
    let mut path = String::new();
    let mut pen_down = false;
    for (x, y) in points {
        if !(x.is_finite() && y.is_finite()) {
            pen_down = false;
            continue;
        }
        let _ = write!(path, "{}{x:.1} {y:.1}", if pen_down { 'L' } else { 'M' });
        pen_down = true;
    }
    let class = color_class(color);
    let _ = write!(s, "<path class=\"{class}\" d=\"{path}\" stroke-width=\"{width}\"/>");
}

fn color_class(color: usize) -> String {
    if color == usize::MAX { "truth".to_owned() } else { format!("s{}", color % COLORS) }
}

/// Entries from right to left, ending at `right`.
fn legend(s: &mut String, right: f64, y: f64, entries: &[(&str, usize)]) {
    let mut x = right;
    for (name, color) in entries.iter().rev() {
        let name = shortened(name, 24);
        x -= 7.0 * name.chars().count() as f64 + 30.0;
        let class = color_class(*color);
        let _ = write!(
            s,
            "<path class=\"{class}\" d=\"M{x:.1} {:.1}h16\" stroke-width=\"3\"/>",
            y - 4.0
        );
        text(s, x + 20.0, y, "start", &name);
    }
}

fn shortened(name: &str, most: usize) -> String {
    if name.chars().count() <= most {
        return name.to_owned();
    }
    let start: String = name.chars().take(most - 1).collect();
    start + "…"
}

fn ticks(most: f64, step: f64) -> impl Iterator<Item = f64> {
    (0..=(most / step).floor() as i64).map(move |i| i as f64 * step)
}

/// As many digits as distinguish a number from one that is `step` away.
fn number(v: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{v:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_series_give_finite_charts() {
        let series = |points: &[(f64, f64)]| Series {
            name: "a<b".to_owned(),
            color: 9,
            points: points.to_vec(),
        };
        for points in [&[][..], &[(0.0, 0.0)], &[(f64::NAN, 1.0), (1.0, f64::INFINITY), (2.0, 1.0)]]
        {
            let text = lines("frame", "cm", &[series(points)]);
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
            assert!(text.contains("a&lt;b") && text.contains("class=\"s3\""));
        }
        let path = Path { name: "p".to_owned(), color: None, points: vec![DVec3::NAN, DVec3::ONE] };
        let text = paths(&[path], DVec3::Y);
        assert!(!text.contains("NaN") && text.contains("z over x"), "{text}");
        let bar = Bar { name: "x".to_owned(), parts: vec![0.0, 0.0] };
        assert!(!bars("s", &["a", "b"], &[bar]).contains("NaN"));
    }

    #[test]
    fn thinning_keeps_peaks() {
        let mut points: Vec<(f64, f64)> = (0..5000).map(|i| (f64::from(i), 1.0)).collect();
        points[1234].1 = 9.0;
        let thin = thinned(&points);
        assert!(thin.len() <= POINTS && thin.contains(&(1234.0, 9.0)));
    }

    #[test]
    fn numbers_have_the_digits_of_their_step() {
        let all = [(0.0, 0.5), (1.415, 0.005), (20.0, 5.0), (300.0, 100.0), (0.05, 0.01)];
        let texts = all.map(|(v, step)| number(v, step));
        assert_eq!(texts, ["0.0", "1.415", "20", "300", "0.05"]);
    }
}
