//! What there is to see of the classes: `legend.png`, `confusion.png` and `classes.csv`.
use super::pictures::{Canvas, class_color};
use crate::metrics::SemanticFigures;
use anyhow::Result;
use mte_slam_metrics::ConfusionMatrix;
use mte_slam_types::classes::ClassTable;
use std::fmt::Write;

const PAPER: [u8; 3] = [255; 3];
const INK: [u8; 3] = [30, 32, 36];
const FAINT: [u8; 3] = [110, 115, 125];
const GRID: [u8; 3] = [225, 228, 232];
/// Side of a glyph at the zoom used here \[pixels\].
const GLYPH: usize = 16;
const ZOOM: usize = 2;
const MARGIN: usize = 16;
/// Longer names are cut \[characters\].
const NAME: usize = 24;

/// Colour, name, id and, where known, IoU of each class: of those that occur or are predicted
/// where there are figures, else of all.
pub fn legend(table: &ClassTable, figures: Option<&SemanticFigures>) -> Result<Vec<u8>> {
    const ROWS: usize = 28;
    const ROW: usize = 26;
    let figure = |id: u16| figures?.classes.iter().find(|c| c.id == id);
    let mut lines = Vec::new();
    for (i, class) in table.classes.iter().enumerate() {
        let known = figure(class.raw_id);
        if figures.is_some() && known.is_none() {
            continue;
        }
        let iou = known.map_or(String::new(), |c| format!("{:5.1} %", c.iou_percent));
        lines.push((class_color(i as u8, table), cut(&class.name), class.raw_id, iou));
    }
    let name_width = lines.iter().map(|l| l.1.chars().count()).max().unwrap_or(0).max(5);
    let id_width = lines.iter().map(|l| l.2.to_string().len()).max().unwrap_or(0).max(2);
    let iou_width = if figures.is_some() { 9 } else { 0 };
    let column = (name_width + id_width + iou_width + 4) * GLYPH + ROW;
    let columns = lines.len().div_ceil(ROWS).max(1);
    let rows = lines.len().div_ceil(columns).max(1);
    let (width, height) = (2 * MARGIN + columns * column, 2 * MARGIN + (rows + 1) * ROW);
    let mut canvas = Canvas::new(width, height, PAPER);
    for (i, (color, name, id, iou)) in lines.iter().enumerate() {
        let x = MARGIN + i / rows * column;
        let y = MARGIN + (i % rows + 1) * ROW;
        if i % rows == 0 {
            let iou = if figures.is_some() { "     IoU" } else { "" };
            let head = format!("{:name_width$} {:>id_width$}{iou}", "class", "id");
            canvas.text(x + ROW + 4, MARGIN, ZOOM, FAINT, &head);
        }
        canvas.fill(x, y - 2, GLYPH + 4, GLYPH + 4, INK);
        canvas.fill(x + 1, y - 1, GLYPH + 2, GLYPH + 2, *color);
        let text = format!("{name:name_width$} {id:>id_width$} {iou}");
        canvas.text(x + ROW + 4, y, ZOOM, INK, &text);
    }
    canvas.png()
}

/// Shares of each true class's pixels by predicted class, rows and columns from the most frequent
/// true class to the least; classes that are neither true nor predicted are left out.
pub fn confusion(table: &ClassTable, matrix: &ConfusionMatrix) -> Result<Vec<u8>> {
    let n = matrix.classes().min(table.len());
    let of_truth = |t: usize| (0..=n).map(|p| matrix.count(t, p)).sum::<u64>();
    let of_prediction = |p: usize| (0..n).map(|t| matrix.count(t, p)).sum::<u64>();
    let mut rows: Vec<usize> = (0..n).filter(|&t| of_truth(t) > 0).collect();
    rows.sort_by_key(|&t| std::cmp::Reverse(of_truth(t)));
    let mut columns = rows.clone();
    columns.extend((0..n).filter(|&p| of_truth(p) == 0 && of_prediction(p) > 0));
    if of_prediction(n) > 0 {
        columns.push(n);
    }
    let name = |c: usize| table.classes.get(c).map_or("(no class)".to_owned(), |c| cut(&c.name));
    // Large enough for three digits, unless there are very many.
    let cell = (1800 / columns.len().max(1)).clamp(14, 52);
    let text = if cell >= 36 { ZOOM } else { 1 };
    let digit = text * 8;
    let shares: Vec<String> =
        rows.iter().map(|&t| share_text(of_truth(t), &rows, of_truth)).collect();
    let longest = columns.iter().map(|&c| name(c).chars().count()).max().unwrap_or(0).max(8);
    let left = MARGIN + (longest + 8) * digit;
    let top = MARGIN + 3 * GLYPH + longest * digit + GLYPH;
    let scale_height = 3 * GLYPH;
    let width = (left + columns.len() * cell + MARGIN).max(MARGIN * 2 + 58 * GLYPH);
    let height = top + rows.len() * cell + MARGIN + scale_height;
    let mut canvas = Canvas::new(width, height, PAPER);
    let title = "Confusion: row = true class, column = rendered class";
    canvas.text(MARGIN, MARGIN, ZOOM, INK, title);
    let note = "% of the row's pixels; beside its name, the class's share";
    canvas.text(MARGIN, MARGIN + GLYPH + 6, ZOOM, FAINT, note);
    for (i, &c) in columns.iter().enumerate() {
        let x = left + i * cell;
        canvas.text_up(x + (cell - digit) / 2, top - 6, text, INK, &name(c));
    }
    for (j, &t) in rows.iter().enumerate() {
        let y = top + j * cell;
        let label = format!("{:>longest$} {:>6}", name(t), shares[j]);
        canvas.text(MARGIN, y + (cell - digit) / 2, text, INK, &label);
        for (i, &p) in columns.iter().enumerate() {
            let share = matrix.count(t, p) as f64 / of_truth(t) as f64;
            let x = left + i * cell;
            canvas.fill(x, y, cell, cell, GRID);
            canvas.fill(x + 1, y + 1, cell - 1, cell - 1, shade(share));
            let percent = format!("{:.0}", 100.0 * share);
            let fits = percent.len() * digit < cell;
            if share >= 0.005 && fits {
                let ink = if share > 0.5 { PAPER } else { INK };
                let u = x + (cell - percent.len() * digit).div_ceil(2);
                canvas.text(u, y + (cell - digit) / 2, text, ink, &percent);
            }
        }
    }
    let y = top + rows.len() * cell + MARGIN;
    canvas.text(left, y, ZOOM, FAINT, "0");
    for k in 0..240 {
        canvas.fill(left + 24 + k, y, 1, GLYPH, shade(k as f64 / 239.0));
    }
    canvas.text(left + 24 + 248, y, ZOOM, FAINT, "100 %");
    canvas.png()
}

fn share_text(pixels: u64, rows: &[usize], of_truth: impl Fn(usize) -> u64) -> String {
    let all: u64 = rows.iter().map(|&t| of_truth(t)).sum();
    let percent = 100.0 * pixels as f64 / all.max(1) as f64;
    if percent < 0.1 { "<0.1%".to_owned() } else { format!("{percent:.1}%") }
}

/// White over blue to nearly black; small shares are lifted, since they are what is looked for.
fn shade(share: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 4] =
        [[255.0, 255.0, 255.0], [158.0, 202.0, 225.0], [33.0, 113.0, 181.0], [8.0, 48.0, 107.0]];
    let t = share.clamp(0.0, 1.0).sqrt() * 3.0;
    let i = (t as usize).min(2);
    let part = t - i as f64;
    core::array::from_fn(|k| (STOPS[i][k] + (STOPS[i + 1][k] - STOPS[i][k]) * part + 0.5) as u8)
}

fn cut(name: &str) -> String {
    if name.chars().count() <= NAME {
        return name.to_owned();
    }
    name.chars().take(NAME - 2).chain("..".chars()).collect()
}

/// One line per class that occurs or is predicted; what is not known is empty. With `input`, the IoU
/// of the labels that the map learnt from.
pub fn csv(figures: &SemanticFigures, input: Option<&SemanticFigures>) -> String {
    let mut text = String::from(
        "id,name,pixels,iou_percent,accuracy_percent,boundary_iou_percent,\
         boundary_f_score_percent,small",
    );
    text += if input.is_some() { ",input_iou_percent\n" } else { "\n" };
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.4}"));
    for c in &figures.classes {
        let name = if c.name.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", c.name.replace('"', "\"\""))
        } else {
            c.name.clone()
        };
        let _ = write!(
            text,
            "{},{name},{},{:.4},{},{},{},{}",
            c.id,
            c.pixels,
            c.iou_percent,
            number(c.accuracy_percent),
            number(c.boundary_iou_percent),
            number(c.boundary_f_score_percent),
            c.small
        );
        if let Some(input) = input {
            let same = input.classes.iter().find(|other| other.id == c.id);
            text += &format!(",{}", number(same.map(|s| s.iou_percent)));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_metrics::SemanticMeter;
    use mte_slam_types::classes::{Class, UNLABELLED};

    fn table(n: u16) -> ClassTable {
        let class = |i| Class {
            raw_id: i * 7,
            name: format!("a \"long\", class name of number {i}"),
            color: [i as u8, 200, 10],
        };
        ClassTable { classes: (0..n).map(class).collect() }
    }

    fn meter(n: usize) -> SemanticMeter {
        let mut m = SemanticMeter::new(n);
        let truth: Vec<u8> = (0..400).map(|i| (i / 20 % n) as u8).collect();
        let mut predicted = truth.clone();
        predicted[..7].fill((n - 1) as u8);
        predicted[30..35].fill(UNLABELLED);
        m.add(20, &truth, &predicted).unwrap();
        m
    }

    #[test]
    fn pictures_hold_any_number_of_classes() {
        for n in [1, 2, 40, 255] {
            let (table, m) = (table(n), meter(usize::from(n)));
            let figures = SemanticFigures::new("dataset", m.report().unwrap(), &table);
            let pictures = [
                legend(&table, Some(&figures)).unwrap(),
                legend(&table, None).unwrap(),
                confusion(&table, m.confusion()).unwrap(),
            ];
            for png in pictures {
                let image = image::load_from_memory(&png).unwrap();
                let (w, h) = (image.width(), image.height());
                assert!(w < 9000 && h < 9000, "{n}: {w}x{h}");
                // Something but paper on it, and paper along its edges.
                let rgb = image.into_rgb8();
                assert!(rgb.pixels().any(|p| p.0 != PAPER));
                assert!((0..h).all(|y| rgb.get_pixel(w - 1, y).0 == PAPER), "{n}");
            }
        }
    }

    #[test]
    fn csv_has_a_line_a_class_and_quotes_names() {
        let (table, m) = (table(3), meter(3));
        let figures = SemanticFigures::new("dataset", m.report().unwrap(), &table);
        let text = csv(&figures, Some(&figures));
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[0].ends_with(",small,input_iou_percent"));
        let start = "7,\"a \"\"long\"\", class name of number 1\",140,";
        assert!(lines[2].starts_with(start), "{text}");
    }
}
