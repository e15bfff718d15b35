//! The report as Markdown: its tables, and links to pictures in the runs' folders.
use super::document::{Block, Document, Table};
use crate::text_table::table as even_table;
use std::fmt::Write;

/// The text of `report.md`.
pub fn markdown(document: &Document) -> String {
    let mut text = format!("# {}\n", document.title);
    for block in &document.blocks {
        match block {
            Block::Heading(level, title) => {
                let _ = write!(text, "\n{} {title}\n", "#".repeat(usize::from(*level)));
            }
            Block::Text(paragraph) => {
                let _ = write!(text, "\n{}\n", paragraph.replace('|', "\\|"));
            }
            Block::List(items) => {
                text += "\n";
                for item in items {
                    let _ = writeln!(text, "- {}", item.replace('\n', " "));
                }
            }
            Block::Table(table) => text += &of_table(table),
            Block::Figures(pictures) => {
                for picture in pictures {
                    if let Some(file) = &picture.file {
                        let _ = write!(text, "\n![{}]({file})\n", picture.caption);
                    }
                }
            }
        }
    }
    text
}

fn of_table(table: &Table) -> String {
    let clean = |cells: &Vec<String>| -> Vec<String> {
        cells.iter().map(|c| c.replace('|', "\\|").replace('\n', " ")).collect()
    };
    let rows: Vec<Vec<String>> = table.rows.iter().map(clean).collect();
    let mut text = format!("\n**{}**\n\n", table.caption);
    text += &even_table(&clean(&table.head), &rows);
    for note in &table.notes {
        let _ = write!(text, "\n{note}\n");
    }
    text
}
