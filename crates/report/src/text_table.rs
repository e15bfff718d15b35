//! Markdown tables that read as text, too.
use std::fmt::Write;

/// A Markdown table with columns of even width, so that it reads as text, too.
pub fn table(head: &[String], lines: &[Vec<String>]) -> String {
    let all = || std::iter::once(head).chain(lines.iter().map(Vec::as_slice));
    let width = |column: usize| all().map(|l| l[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let mut text = String::new();
    for (i, line) in all().enumerate() {
        let cells: Vec<String> = line
            .iter()
            .zip(&widths)
            .enumerate()
            .map(
                |(k, (cell, &w))| if k == 0 { format!("{cell:w$}") } else { format!("{cell:>w$}") },
            )
            .collect();
        let _ = writeln!(text, "| {} |", cells.join(" | "));
        if i == 0 {
            let rules: Vec<String> = widths
                .iter()
                .enumerate()
                .map(|(k, &w)| if k == 0 { "-".repeat(w) } else { "-".repeat(w - 1) + ":" })
                .collect();
            let _ = writeln!(text, "| {} |", rules.join(" | "));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_markdown_with_even_columns() {
        let lines = [vec!["both".to_owned(), "1.0 ± 0.2".to_owned()]];
        let text = table(&["row".to_owned(), "mIoU".to_owned()], &lines);
        assert_eq!(text, "| row  |      mIoU |\n| ---- | --------: |\n| both | 1.0 ± 0.2 |\n");
    }
}
