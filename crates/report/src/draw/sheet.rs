//! Comparison sheets: what the camera saw, what the map renders, and the error, side by side.
use super::{
    colormap::turbo,
    pictures::{Canvas, class_color},
};
use anyhow::Result;
use mte_slam_core::slam::View;
use mte_slam_types::{
    classes::{ClassTable, UNLABELLED},
    frame::Frame,
};
use std::collections::BTreeSet;

const PAPER: [u8; 3] = [24, 26, 30];
const INK: [u8; 3] = [235, 235, 235];
const FAINT: [u8; 3] = [150, 155, 165];
const GAP: usize = 8;
/// Where there is no depth: no colour of the map has equal parts.
const NO_DEPTH: [u8; 3] = [90; 3];
/// Colour error at the top of its scale, of 255.
const COLOR_ERROR: f64 = 64.0;
/// Depth error at the top of its scale \[m\].
const DEPTH_ERROR_M: f64 = 0.10;

/// Wrong pixels, and those that were right in the input.
const WRONG: [u8; 3] = [235, 50, 60];
/// Right pixels that were wrong in the input.
const MENDED: [u8; 3] = [60, 200, 90];

/// What a sheet shows.
pub struct Sheet<'a> {
    /// Sequence and frame.
    pub title: &'a str,
    /// What the camera saw, with the labels that the map learnt from.
    pub frame: &'a Frame,
    /// Metres per unit of the frame's depth.
    pub depth_unit_m: f64,
    /// What the map renders.
    pub view: &'a View,
    /// Classes of frame, view and true labels; classes are not shown when it is empty.
    pub table: &'a ClassTable,
    /// What the classes are scored against.
    pub true_labels: Option<&'a [u8]>,
    /// Whether those are not the frame's own: then a row compares the input with them too.
    pub own_truth: bool,
}

/// A sheet as PNG.
pub fn sheet(sheet: &Sheet) -> Result<Vec<u8>> {
    let Sheet { title, frame, depth_unit_m, view, table, true_labels, own_truth } = *sheet;
    let (w, h) = (view.camera.width as usize, view.camera.height as usize);
    // Panels wide enough for their captions.
    let zoom = 320usize.div_ceil(w).max(1);
    let text = if w * zoom >= 800 { 2 } else { 1 };
    let band = 14 * text;
    let bar = 20 * text;
    let with_classes = !table.is_empty();
    let (pw, ph) = (w * zoom, h * zoom);
    let compared = true_labels.filter(|_| own_truth && with_classes);
    let rows = 2 + usize::from(with_classes) + usize::from(compared.is_some());
    let legend = if with_classes {
        legend_entries([frame.labels.as_deref(), Some(&view.class), compared])
    } else {
        Vec::new()
    };
    let columns = (3 * pw + 2 * GAP) / (180 * text);
    let legend_height = legend.len().div_ceil(columns.max(1)) * band + GAP;
    let width = 3 * pw + 4 * GAP;
    let row_height = band + ph + bar;
    let height = GAP + band + rows * row_height + legend_height + GAP;
    let mut canvas = Canvas::new(width, height, PAPER);
    canvas.text(GAP, GAP, text, INK, title);
    let x = |column: usize| GAP + column * (pw + GAP);
    let y = |row: usize| GAP + band + row * row_height;
    let mut panel = |row: usize, column: usize, caption: &str, image: &[[u8; 3]]| {
        canvas.text(x(column), y(row) + band - 10 * text, text, INK, caption);
        canvas.image(x(column), y(row) + band, w, zoom, image);
    };

    // Colour. Pixels where the map has nothing count as they are shown: black.
    let error: Vec<f64> = frame
        .color
        .iter()
        .zip(&view.color)
        .map(|(a, b)| (0..3).map(|k| f64::from(a[k].abs_diff(b[k]))).sum::<f64>() / 3.0)
        .collect();
    let square: f64 = frame
        .color
        .as_flattened()
        .iter()
        .zip(view.color.as_flattened())
        .map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2))
        .sum();
    let mse = square / (3 * frame.color.len().max(1)) as f64;
    let psnr = if mse > 0.0 { 10.0 * (255.0f64.powi(2) / mse).log10() } else { f64::INFINITY };
    panel(0, 0, "input colour", &frame.color);
    panel(0, 1, &format!("rendered colour  PSNR {psnr:.1} dB"), &view.color);
    let image: Vec<_> = error.iter().map(|e| turbo(e / COLOR_ERROR)).collect();
    panel(0, 2, "absolute colour error", &image);

    // Depth; grey where there is no measurement or nothing rendered.
    let input: Vec<f64> = frame.depth.iter().map(|&d| f64::from(d) * depth_unit_m).collect();
    let rendered: Vec<f64> = view.depth_m.iter().map(|&d| f64::from(d)).collect();
    let (near, far) = depth_range(&input).or(depth_range(&rendered)).unwrap_or((0.0, 1.0));
    let shade = |d: &f64| if *d > 0.0 { turbo((d - near) / (far - near)) } else { NO_DEPTH };
    panel(1, 0, "input depth", &input.iter().map(shade).collect::<Vec<_>>());
    panel(1, 1, "rendered depth (unguided)", &rendered.iter().map(shade).collect::<Vec<_>>());
    let both: Vec<Option<f64>> = input
        .iter()
        .zip(&rendered)
        .map(|(a, b)| (*a > 0.0 && *b > 0.0).then(|| (a - b).abs()))
        .collect();
    let count = both.iter().flatten().count().max(1) as f64;
    let l1 = 100.0 * both.iter().flatten().sum::<f64>() / count;
    let image: Vec<_> =
        both.iter().map(|e| e.map_or(NO_DEPTH, |e| turbo(e / DEPTH_ERROR_M))).collect();
    panel(1, 2, &format!("depth error  L1 {l1:.2} cm"), &image);

    if with_classes {
        let colors = |c: &[u8]| c.iter().map(|&c| class_color(c, table)).collect::<Vec<_>>();
        if let Some(labels) = &frame.labels {
            panel(2, 0, "input classes", &colors(labels));
        }
        panel(2, 1, "rendered classes", &colors(&view.class));
        // On the input's brightness; black without a true class.
        let marked = |truth: &[u8], mark: &dyn Fn(usize) -> Option<[u8; 3]>| -> Vec<[u8; 3]> {
            let grey = |c: &[u8; 3]| (c.iter().map(|&v| u32::from(v)).sum::<u32>() / 6) as u8;
            (0..truth.len())
                .map(|i| match truth[i] {
                    UNLABELLED => [0; 3],
                    _ => mark(i).unwrap_or([grey(&frame.color[i]); 3]),
                })
                .collect()
        };
        if let Some(truth) = true_labels {
            let image = marked(truth, &|i| (view.class[i] != truth[i]).then_some(WRONG));
            let percent = percent_right(truth, &view.class);
            panel(2, 2, &format!("rendered: wrong (red)  {percent:.1} % right"), &image);
        }
        if let Some(truth) = compared {
            panel(3, 0, "true classes", &colors(truth));
            if let Some(input) = &frame.labels {
                let image = marked(truth, &|i| (input[i] != truth[i]).then_some(WRONG));
                let percent = percent_right(truth, input);
                panel(3, 1, &format!("input: wrong (red)  {percent:.1} % right"), &image);
                let image =
                    marked(truth, &|i| match (input[i] == truth[i], view.class[i] == truth[i]) {
                        (true, false) => Some(WRONG),
                        (false, true) => Some(MENDED),
                        _ => None,
                    });
                panel(3, 2, "mended (green), spoilt (red)", &image);
            }
        }
    }

    scale_bar(&mut canvas, x(2), y(1) - bar + 3, pw, text, "0", &format!("{COLOR_ERROR}/255"));
    let depth_y = y(1) + band + ph + 3;
    let (low, high) = (format!("{near:.1} m"), format!("{far:.1} m"));
    scale_bar(&mut canvas, x(0), depth_y, pw, text, &low, &high);
    scale_bar(&mut canvas, x(1), depth_y, pw, text, &low, &high);
    let top = format!("{:.0} cm", DEPTH_ERROR_M * 100.0);
    scale_bar(&mut canvas, x(2), depth_y, pw, text, "0", &top);
    for (i, &class) in legend.iter().enumerate() {
        let lx = GAP + i % columns * (180 * text);
        let ly = y(rows) + i / columns * band;
        canvas.fill(lx, ly, 10 * text, 8 * text, class_color(class, table));
        let name: String = table.classes[usize::from(class)].name.chars().take(19).collect();
        canvas.text(lx + 14 * text, ly, text, FAINT, &name);
    }
    canvas.png()
}

/// Share of the labelled pixels with the right class \[%\].
fn percent_right(truth: &[u8], classes: &[u8]) -> f64 {
    let labelled = || truth.iter().zip(classes).filter(|(t, _)| **t != UNLABELLED);
    let right = labelled().filter(|(t, c)| t == c).count();
    100.0 * right as f64 / labelled().count().max(1) as f64
}

/// Classes of any of the images, in the table's order.
fn legend_entries(images: [Option<&[u8]>; 3]) -> Vec<u8> {
    let seen: BTreeSet<u8> = images.into_iter().flatten().flatten().copied().collect();
    seen.into_iter().filter(|&c| c != UNLABELLED).collect()
}

/// 1st and 99th percentile of the valid depths, so that one far pixel does not flatten the rest.
fn depth_range(depth_m: &[f64]) -> Option<(f64, f64)> {
    let mut valid: Vec<f64> = depth_m.iter().copied().filter(|d| *d > 0.0).collect();
    valid.sort_by(f64::total_cmp);
    let (near, far) = (*valid.get(valid.len() / 100)?, *valid.get(valid.len() * 99 / 100)?);
    Some((near, far.max(near + 0.1)))
}

fn scale_bar(
    canvas: &mut Canvas,
    x: usize,
    y: usize,
    width: usize,
    text: usize,
    low: &str,
    high: &str,
) {
    let left = x + (low.len() * 8 + 6) * text;
    let right = x + width - (high.len() * 8 + 6) * text;
    canvas.text(x, y, text, FAINT, low);
    canvas.text(right + 6 * text, y, text, FAINT, high);
    for u in left..right {
        let color = turbo((u - left) as f64 / (right - left) as f64);
        canvas.fill(u, y, 1, 8 * text, color);
    }
}
